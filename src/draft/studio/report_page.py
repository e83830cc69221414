"""The report page of a tab: its design, compared with the pinned one."""

from __future__ import annotations

from html import escape

from draft.errors import DraftError
from draft.reporting.page import page
from draft.reporting.subjects import subjects
from draft.studio.session import Session
from draft.webpage import webpage


def report_page(session: Session) -> str:
    """HTML of the report, or of the error message where it cannot be made."""
    designs = [session.design]
    if session.pinned is not None and session.pinned.design is not session.design:
        designs.insert(0, session.pinned.design)
    try:
        return page(subjects(designs))
    except DraftError as error:
        return webpage("Draft", "", f"<pre>{escape(str(error))}</pre>")
