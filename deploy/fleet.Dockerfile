# A fleet service (docs/howto/fleet.md):
#   docker build -f deploy/fleet.Dockerfile -t firstfix-fleet .
#   docker run --rm -p 8643:8643 -v ./floors:/maps:ro -e FIRSTFIX_TOKEN firstfix-fleet
FROM python:3.12-slim AS build
COPY . /tmp/firstfix
RUN python -m venv /opt/firstfix \
    && /opt/firstfix/bin/pip install --no-cache-dir '/tmp/firstfix[fleet]'
# Compiled kernels depend on the processor: generic ones are valid on every machine.
ENV NUMBA_CPU_NAME=generic
RUN /opt/firstfix/bin/firstfix doctor

FROM python:3.12-slim
RUN useradd --create-home --uid 1000 firstfix && install -d -o firstfix /prepared
# Compiled kernels are used only where their folder can be written.
COPY --from=build --chown=firstfix /opt/firstfix /opt/firstfix
ENV PATH=/opt/firstfix/bin:$PATH \
    NUMBA_CPU_NAME=generic \
    FIRSTFIX_CACHE_DIR=/prepared
USER 1000
VOLUME /prepared
EXPOSE 8643
HEALTHCHECK CMD ["python", "-c", "import urllib.request as u; u.urlopen('http://127.0.0.1:8643/healthz')"]
ENTRYPOINT ["firstfix", "fleet", "serve"]
CMD ["/maps", "--host", "0.0.0.0"]
