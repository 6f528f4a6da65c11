# firstfix beside or instead of AMCL, for ROS 1 (a robot with Noetic has a Python that is too old):
#   docker build -f docker/ros1.Dockerfile -t firstfix:ros1 .
#   docker run --rm --network host -e ROS_MASTER_URI -e ROS_IP firstfix:ros1 scan:=base_scan
FROM debian:12-slim
# The archive keeps only the newest version of a package: a pinned one could not be built later.
# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install -y --no-install-recommends \
       python3-venv python3-rospy python3-tf2-msgs python3-sensor-msgs python3-nav-msgs \
    && rm -rf /var/lib/apt/lists/*
COPY . /tmp/firstfix
RUN python3 -m venv --system-site-packages /opt/firstfix \
    && /opt/firstfix/bin/pip install --no-cache-dir /tmp/firstfix \
    && rm -rf /tmp/firstfix
# Compiled kernels depend on the processor: generic ones are valid on every robot.
ENV NUMBA_CPU_NAME=generic FIRSTFIX_CACHE_DIR=/opt/firstfix/cache
RUN /opt/firstfix/bin/firstfix doctor
ENTRYPOINT ["/opt/firstfix/bin/firstfix", "ros1"]
