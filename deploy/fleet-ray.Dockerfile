# A fleet service on Ray, for deploy/rayservice.yaml. Its Python and Ray are those of the base image:
#   docker build -f deploy/fleet-ray.Dockerfile -t firstfix-fleet-ray .
FROM rayproject/ray:2.60.0-py312-cpu
COPY --chown=ray . /tmp/firstfix
RUN pip install --no-cache-dir '/tmp/firstfix[fleet]'
ENV NUMBA_CPU_NAME=generic \
    FIRSTFIX_CACHE_DIR=/prepared \
    RAY_USAGE_STATS_ENABLED=0
RUN firstfix doctor
