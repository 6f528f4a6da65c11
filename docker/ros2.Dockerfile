# firstfix beside or instead of AMCL, for ROS 2:
#   docker build -f docker/ros2.Dockerfile --build-arg ROS_DISTRO=humble -t firstfix:humble .
#   docker run --rm --network host firstfix:humble --ros-args -p autostart:=true
ARG ROS_DISTRO=humble
FROM ros:${ROS_DISTRO}-ros-base
ARG ROS_DISTRO
# The archive keeps only the newest version of a package: a pinned one could not be built later.
# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install -y --no-install-recommends python3-venv \
       "ros-${ROS_DISTRO}-nav2-msgs" "ros-${ROS_DISTRO}-bond" "ros-${ROS_DISTRO}-tf2-msgs" \
    && rm -rf /var/lib/apt/lists/*
COPY . /tmp/firstfix
RUN python3 -m venv --system-site-packages /opt/firstfix \
    && /opt/firstfix/bin/pip install --no-cache-dir /tmp/firstfix \
    && rm -rf /tmp/firstfix
# Compiled kernels depend on the processor: generic ones are valid on every robot.
ENV NUMBA_CPU_NAME=generic \
    FIRSTFIX_CACHE_DIR=/opt/firstfix/cache \
    AMENT_PREFIX_PATH=/opt/firstfix
SHELL ["/bin/bash", "-c"]
RUN source "/opt/ros/${ROS_DISTRO}/setup.bash" && /opt/firstfix/bin/firstfix doctor
ENTRYPOINT ["/ros_entrypoint.sh", "/opt/firstfix/bin/firstfix", "ros2"]
