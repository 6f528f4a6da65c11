"""Many maps: which map, and where in it.

::

    site = Site.load("floors")  # a folder of maps, or a site.yaml
    result = site.locate(scan)  # one verdict over all maps

The same in two stages, whose inputs and results can be pickled, for maps that are spread over
processes::

    looked = site.first_look(query)  # how promising each map is
    found = site.search(query, looked.promising)  # verified places
    result = judge_site(query, [looked], [found])  # one verdict
"""
