"""`brdf serve`: starts the HTTP service."""

import contextlib
import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from service.settings import Settings


def command(
    host: Annotated[str | None, typer.Option(help="Address to listen on; by default this machine only.")] = None,
    port: Annotated[int | None, typer.Option(help="Port to listen on; by default 8000.")] = None,
    data: Annotated[Path | None, typer.Option(help="Folder of datasets, jobs and results.")] = None,
) -> None:
    """Start the service; print its address and where its data lives, and run until interrupted."""
    from service.app import server
    from service.settings import Settings

    settings = Settings.from_environment(host=host, port=port, data=data)
    settings.check_open()
    settings.data.mkdir(parents=True, exist_ok=True)
    with _bound(settings) as listener:
        typer.echo(f"Service: {_url(listener)}  (its documentation: {_url(listener)}/docs)")
        typer.echo(f"Data:    {settings.data.resolve()}")
        keys = len(settings.api_keys)
        who = "this machine only" if settings.loopback else "other machines too"
        typer.echo(f"Open to: {who}, {f'with one of {keys} API keys' if keys else 'without a key'}")
        server(settings).run(sockets=[listener])


@contextlib.contextmanager
def background(settings: "Settings") -> Iterator[str]:
    """The URL of a service that runs in this process, in a thread, until the block ends."""
    from service.app import server

    with _bound(settings) as listener:
        serving = server(settings)
        thread = threading.Thread(target=serving.run, kwargs={"sockets": [listener]}, name="brdf-service")
        thread.start()
        try:
            while not serving.started and thread.is_alive():
                time.sleep(0.01)
            yield _url(listener)
        finally:
            serving.should_exit = True
            thread.join()


@contextlib.contextmanager
def _bound(settings: "Settings") -> Iterator[socket.socket]:
    """A socket that is bound before anything is started, so that a port in use is one sentence."""
    from ..errors import InvalidValueError

    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((settings.host, settings.port))
        except OSError as error:
            raise InvalidValueError(
                f"Expected {settings.host}:{settings.port} to be free to listen on, got: {error.strerror}. "
                "Choose another with --port.",
                field="port",
            ) from error
        yield listener


def _url(listener: socket.socket) -> str:
    host, port = listener.getsockname()[:2]
    return f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"
