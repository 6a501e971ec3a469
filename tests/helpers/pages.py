"""A page that is served to the tests."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from modelica_like.page import PageServer, Session


@contextmanager
def serving(session: Session) -> Iterator[PageServer]:
    """Serve the page of a session in a thread."""
    with PageServer(session) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
        thread.start()
        try:
            yield server
        finally:
            server.shutdown()
            thread.join()
