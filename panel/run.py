"""A command that runs elsewhere, as it tells of itself in a file: how far it is, what it says, and its page once there is one.

Whoever runs writes the file (run/1), the panel reads it.
"""

from __future__ import annotations

import mimetypes
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field
from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse, Response
from starlette.routing import Route

FILE = "run.json"
"""Name of the file in the folder that is told."""

MOST_LINES = 200
"""Of what it says, the last ones."""

_POLICY = (
    "sandbox allow-scripts; default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; "
    "frame-ancestors 'self'"
)
"""A report draws by scripts of its own; it loads nothing, and is no page of the panel's origin."""

Share = Annotated[float, Field(ge=0.0, le=1.0)]


class _Told(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Phase(_Told):
    """What is done one after the other; `share` of it that is done."""

    name: str
    share: Share


class Run(_Told):
    """run/1. `share` of the whole, None: not known. `outcome`: how it ended, empty while it runs. `page`: a file."""

    format: Literal["run/1"] = "run/1"
    command: str
    share: Share | None = None
    phases: list[Phase] = []
    lines: list[str] = []
    outcome: str = ""
    page: str | None = None


class RunWatch:
    """The run whose file is in `folder`."""

    def __init__(self, folder: Path) -> None:
        self._file = folder / FILE

    def run(self) -> Run:
        """As it tells now; one that has not told anything yet is there all the same."""
        try:
            return Run.model_validate_json(self._file.read_bytes())
        except FileNotFoundError:
            return Run(command="")

    def told(self) -> dict[str, object]:
        """For the page, with the address of the page of the run."""
        run = self.run()
        return {**run.model_dump(exclude={"format"}), "page": None if run.page is None else f"/run/{Path(run.page).name}"}

    def files(self) -> list[Route]:
        """Its page, and what that links to below its folder."""
        return [Route("/run/{path:path}", self._answer)]

    def _answer(self, request: Request) -> Response:
        page = self.run().page
        if page is None:
            return PlainTextResponse("this run has no page yet\n", 404)
        folder = Path(page).resolve().parent
        asked = (folder / request.path_params["path"]).resolve()
        if not asked.is_relative_to(folder) or not asked.is_file():
            return PlainTextResponse(f"there is no such file beside {page}\n", 404)
        kind = mimetypes.guess_type(asked)[0] or "text/plain"
        return FileResponse(asked, media_type=kind, headers={"content-security-policy": _POLICY})
