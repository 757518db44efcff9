# Plays episodes and writes pages. Two variants:
#
#   docker build -t roboirg .                                    the processor renders
#   docker build -t roboirg:gpu --build-arg VARIANT=gpu .        an NVIDIA GPU renders
#   mkdir -p runs
#   docker run --rm --user "$(id -u)" -v roboirg-models:/models -v "$PWD/runs:/runs" roboirg run --plan demo --out /runs/demo
#   docker run --rm --gpus all -v roboirg-models:/models -v "$PWD/runs:/runs" roboirg:gpu doctor
#
# The model files are not in the image, as their license differs (docs/licenses.md). A container fetches
# them when it starts, if they are not in /models; the volume keeps them.
ARG VARIANT=cpu

FROM python:3.12-slim-trixie AS wheel
WORKDIR /source
COPY pyproject.toml README.md LICENSE NOTICE ./
COPY src src
RUN pip wheel --no-cache-dir --no-deps --wheel-dir /wheels .

FROM python:3.12-slim-trixie AS base
# OpenCV's wheel links these libraries, even for use without a window.
# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install --yes --no-install-recommends libgl1 libglib2.0-0t64 libvulkan1 libegl1 \
    && rm -rf /var/lib/apt/lists/*

FROM base AS cpu
# Lavapipe renders on the processor.
# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install --yes --no-install-recommends mesa-vulkan-drivers \
    && rm -rf /var/lib/apt/lists/*

FROM base AS gpu
# The driver comes from the host, with its graphics part if asked for. Vulkan finds it by one of these
# files, and without a display it finds its own EGL by the other, which not every host brings.
ENV NVIDIA_DRIVER_CAPABILITIES=all NVIDIA_VISIBLE_DEVICES=all
RUN mkdir -p /etc/vulkan/icd.d /usr/share/glvnd/egl_vendor.d \
    && printf '{"file_format_version": "1.0.0", "ICD": {"library_path": "libGLX_nvidia.so.0", "api_version": "1.3.0"}}\n' \
        > /etc/vulkan/icd.d/nvidia_icd.json \
    && printf '{"file_format_version": "1.0.0", "ICD": {"library_path": "libEGL_nvidia.so.0"}}\n' \
        > /usr/share/glvnd/egl_vendor.d/10_nvidia.json

# hadolint ignore=DL3006
FROM ${VARIANT}
ENV ROBOIRG_MODEL_FILES=/models
RUN --mount=from=wheel,source=/wheels,target=/wheels \
    pip install --no-cache-dir "$(echo /wheels/*.whl)[sim,report,remote]" \
    && useradd --create-home --uid 1000 player \
    && install -d -o player /runs \
    && install -d -m 1777 /models
USER 1000
WORKDIR /runs
# A container without a network still makes tables: only what plays needs the model files, and says so.
ENTRYPOINT ["sh", "-c", "roboirg fetch-models >/dev/null; exec roboirg \"$@\"", "roboirg"]
CMD ["doctor"]
