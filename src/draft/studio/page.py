"""The report of a tab's design, and of the one pinned beside it, as a page of its own."""

from __future__ import annotations

from html import escape

from draft.errors import DraftError
from draft.reporting.page import page
from draft.reporting.subjects import subjects
from draft.studio.session import Session


def report_page(session: Session) -> str:
    """HTML of the report; of what is missing where it cannot be made."""
    designs = [session.design]
    if session.pinned is not None and session.pinned.design is not session.design:
        designs.append(session.pinned.design)
    try:
        return page(subjects(designs))
    except DraftError as error:
        text = escape(str(error))
        return f'<!doctype html><html lang="en"><meta charset="utf-8"><title>Draft</title>{text}'
