"""Gamepads: what their page sends is read, and nothing else is."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from draft.serving.gamepad import Gamepad, Sticks


@given(
    shares=st.tuples(*[st.integers(-100, 100)] * 3),
    push=st.sampled_from((-1, 0, 1)),
)
def test_every_state_arrives(shares: tuple[int, int, int], push: int) -> None:
    arrived: list[Sticks] = []
    gamepad = Gamepad(arrived.append)
    assert gamepad.page(f"{gamepad.path}/{'/'.join(map(str, shares))}/{push}") == ""
    assert [round(100 * share) for share in arrived[0][:3]] == list(shares)
    assert arrived[0].push == push


OTHER = ("/", "/0/0/0", "/0/0/0/2", "/101/0/0/0", "/0/0/0/0/0", "/nan/0/0/0", "/1e2/0/0/0")


def test_other_messages_and_other_paths_are_not_read() -> None:
    arrived: list[Sticks] = []
    one, other = Gamepad(arrived.append), Gamepad(arrived.append)
    assert one.path != other.path
    paths = [one.path + state for state in (*OTHER, "x/0/0/0/0")]
    for path in (*paths, f"{other.path}/100/0/0/1", "/gamepad/"):
        assert one.page(path) is None, path
    assert arrived == []


def test_its_page_may_send_requests_to_its_own_server_and_load_nothing() -> None:
    gamepad = Gamepad(lambda _: None)
    page = gamepad.page(gamepad.path)
    assert page is not None
    assert "default-src 'none'" in page
    assert "connect-src 'self'" in page
    assert f'src="{gamepad.path}"' in gamepad.frame
