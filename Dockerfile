# svaedc with every package pinned: docker build -t svaedc .   docker run --rm -v "$PWD:/data" svaedc demo
FROM python:3.11-slim-bookworm

# PyTorch: `--build-arg TORCH_INDEX=URL` names the package index that serves the build you want, PyTorch's CPU wheels for
# example; without it the usual index serves the CUDA build.
ARG TORCH_INDEX=""

WORKDIR /opt/svaedc
COPY pyproject.toml constraints.txt README.md LICENSE ./
COPY workers workers
COPY svaedc svaedc
COPY cluster cluster
RUN if [ -n "$TORCH_INDEX" ]; then \
        pip install --no-cache-dir -c constraints.txt --index-url "$TORCH_INDEX" torch; \
    fi \
    && pip install --no-cache-dir -c constraints.txt '.[video]'

# Nothing here reports home, and nothing runs as root.
ENV RAY_USAGE_STATS_ENABLED=0 \
    MLFLOW_DISABLE_TELEMETRY=true
RUN useradd --create-home --uid 1000 svaedc \
    && mkdir /data \
    && chown svaedc /data
USER 1000
WORKDIR /data
ENTRYPOINT ["svaedc"]
CMD ["--help"]
