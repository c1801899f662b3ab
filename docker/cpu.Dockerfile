# Image for CPUs, with the command and the Python package of pictura.
#   docker build -f docker/cpu.Dockerfile -t pictura .
#   docker run --rm -v "$PWD:/data" pictura map procedural:7 --png town.png
# For training add --build-arg TORCH=torch==2.11.0 (docs/how-to/docker.md explains how to keep the image small).
ARG BASE=debian:12-slim
FROM ${BASE} AS build
ARG TORCH=""
ARG PIP_EXTRA_INDEX_URL
COPY . /src
RUN /src/docker/build_wheel "${TORCH}"

FROM ${BASE}
ARG TORCH=""
ARG PIP_EXTRA_INDEX_URL
# hadolint ignore=DL3008
RUN apt-get update -qq \
    && apt-get install -y -qq --no-install-recommends python3 python3-venv fontconfig-config fonts-dejavu-core libxext6 libxrender1 \
    && rm -rf /var/lib/apt/lists/*
RUN --mount=type=bind,from=build,source=/wheels,target=/wheels \
    python3 -m venv /opt/pictura \
    && /opt/pictura/bin/pip install --no-cache-dir ${TORCH} /wheels/*.whl "gymnasium>=1.1"
ENV PATH=/opt/pictura/bin:$PATH
WORKDIR /data
ENTRYPOINT ["pictura"]
CMD ["--help"]
