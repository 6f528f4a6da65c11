"""A belief over the whole map: several views, judged together (Markov localization).

::

    belief = begin(fields, prior)  # all mass is elsewhere
    belief = predict(belief, T_odom_base)  # motion: every place moves with the odometry
    if brings_news(belief, T_odom_base):  # moved 0.3 m or turned 15 degrees
        belief = update(belief, View.of(scan, T_odom_base))
    belief.verdict, belief.reason  # UNIQUE: the best place may be published
    belief.places  # id, and a Hypothesis: pose, covariance, ...
    belief.elsewhere  # probability of no place that is held
    belief.poses, belief.probabilities  # everything that is held, for a picture

`Belief` is a value: nothing changes it, and the same calls give the same belief to the last bit.
There is no clock, no randomness and no thread. `update` does what Fox, Burgard and Thrun (JAIR
1999) do for every cell of a grid of poses, for the poses that an exhaustive search of the map
cannot rule out:

1. *Motion.* Each place that is held moves with the odometry and is adjusted to the new view,
   within what odometry leaves uncertain.
2. *Entry.* The view's own search of the whole map proposes places. They get a past: poses and costs
   at the earlier views of the window. So a place that was dropped, or that a kidnapped robot is at,
   is weighed by the same views as all others.
3. *Evidence.* The cost at each view that is kept becomes a likelihood by the power law of the
   static stage, and these are multiplied. Their exponents sum to one that grows with the number
   of independent views. Priors are added.
4. *Merging.* Poses at one place become one and keep the oldest id; what is negligible is dropped,
   and its mass is elsewhere.
5. *Elsewhere.* Places that are not held get probability, too: little if the best place explains
   every view better than the third best place of that view's own search does.
6. *Verdict.* A place is published when it is sure in two views from different poses. A sensor that
   sees much may decide by one scan, as in the static stage; a prior counts as a first view.

A view at the pose of the latest one joins it: several scans at rest tell people from walls
(`longest_consistent`). `locate_several` is the same over a list of scans. Priors are pure functions
of pose: `Near`, `Region`, `All`.
"""
