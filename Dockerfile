# The service in a slim image that runs as an ordinary user.
#
#   docker build -t brdf .
#   docker run --rm -p 127.0.0.1:8000:8000 -v brdf-data:/data -e BRDF_API_KEYS="a long random key" brdf
#
# It listens on every address, so without a key it does not start.

FROM python:3.12-slim AS build
WORKDIR /source
RUN python -m venv /venv
COPY .ci/constraints.txt .ci/constraints.txt
COPY pyproject.toml README.md LICENSE ./
COPY brdfcore brdfcore
COPY service service
RUN /venv/bin/pip install --no-cache-dir -c .ci/constraints.txt '.[arrow]'

FROM python:3.12-slim
RUN useradd --create-home --uid 10001 brdf && install -d -o brdf -g brdf /data
COPY --from=build /venv /venv
ENV PATH=/venv/bin:$PATH \
    PYTHONUNBUFFERED=1 \
    BRDF_DATA=/data \
    BRDF_HOST=0.0.0.0
USER brdf
VOLUME /data
EXPOSE 8000
HEALTHCHECK --interval=30s --timeout=3s --start-period=20s \
    CMD ["python", "-c", "import urllib.request; urllib.request.urlopen('http://127.0.0.1:8000/healthz', timeout=2)"]
CMD ["brdf", "serve"]
