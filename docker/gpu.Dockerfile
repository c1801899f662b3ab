# Image for NVIDIA GPUs, with training. At run time it uses the CUDA libraries of torch's wheel.
#   docker build -f docker/gpu.Dockerfile -t pictura-gpu .
#   docker run --rm --gpus all -v "$PWD:/data" pictura-gpu train --config demo.toml --out runs/demo
ARG BASE=ubuntu:24.04
FROM nvidia/cuda:13.0.1-devel-ubuntu24.04 AS build
ARG TORCH="torch==2.11.0"
COPY . /src
RUN /src/docker/build_wheel "${TORCH}"

FROM ${BASE}
ARG TORCH="torch==2.11.0"
# hadolint ignore=DL3008
RUN apt-get update -qq \
    && apt-get install -y -qq --no-install-recommends python3 python3-venv fontconfig-config fonts-dejavu-core libegl1 libxext6 libxrender1 \
    && rm -rf /var/lib/apt/lists/*
RUN --mount=type=bind,from=build,source=/wheels,target=/wheels \
    python3 -m venv /opt/pictura \
    && /opt/pictura/bin/pip install --no-cache-dir "${TORCH}" /wheels/*.whl "gymnasium>=1.1"
ENV PATH=/opt/pictura/bin:$PATH \
    NVIDIA_VISIBLE_DEVICES=all \
    NVIDIA_DRIVER_CAPABILITIES=compute,utility,graphics
WORKDIR /data
ENTRYPOINT ["pictura"]
CMD ["--help"]
