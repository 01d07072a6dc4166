# docker build -t kendama . && docker run --rm -v "$PWD:/work" kendama run
FROM python:3.12-slim AS build
COPY . /source
RUN pip wheel --no-deps --wheel-dir /wheels /source

FROM python:3.12-slim
COPY --from=build /wheels /wheels
RUN pip install --no-cache-dir /wheels/*.whl && rm -r /wheels && useradd --create-home kendama
USER kendama
WORKDIR /work
ENTRYPOINT ["kendama"]
CMD ["--help"]
