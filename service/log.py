"""The log: JSON lines on standard error, whoever in the process has something to say."""

import json
import logging

_AROUND = ("uvicorn", "asyncio")  # whose warnings count, and nothing below


def begin(level: str) -> None:
    """Write the lines from now on: the service's from that level on, and the warnings of the server around it."""
    lines = logging.StreamHandler()
    lines.setFormatter(JsonLines())
    for name, least in (("service", level), *((name, "warning") for name in _AROUND)):
        log = logging.getLogger(name)
        log.handlers = [lines]
        log.propagate = False
        log.setLevel(least.upper())


class JsonLines(logging.Formatter):
    """One JSON object a line: time, level, logger, message, and the fields that the record carries."""

    def format(self, record: logging.LogRecord) -> str:
        """The line."""
        said = {
            "time": self.formatTime(record, "%Y-%m-%dT%H:%M:%S%z"),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
            **getattr(record, "fields", {}),
        }
        if record.exc_info:
            said["exception"] = self.formatException(record.exc_info)
        return json.dumps(said, ensure_ascii=True)
