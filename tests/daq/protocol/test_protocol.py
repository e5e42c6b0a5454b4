"""The protocol of a commissioning: its figures are the recording's, it is one page, and of nothing else."""

from __future__ import annotations

import json
import shutil
import sys
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from pypdf import PdfReader

from daq.catalogue import runs
from daq.catalogue.database import Catalogue
from daq.files.checksum import file_sha256
from daq.protocol.content import Protocol, ProtocolError, _span, protocol_of
from daq.protocol.paper import HEIGHT, MARGIN, WIDTH, pdf_of, render_protocol
from daq.session.stages import STAGES, StageName, fingerprint
from robots import Robot
from tests.daq.calls import Call
from tests.daq.captures import BATCH, PERIOD, record, samples
from tests.daq.session.commissioned import SHA256, real_identity


@pytest.fixture
def walked(tx40: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The recording of the full run of an arm that has passed every stage."""
    capture = record(tmp_path / "full-run.mcap", tx40, [samples(0, 4 * BATCH)], monkeypatch)
    keep(tx40, capture)
    return capture


def keep(robot: Robot, capture: Path | None, until: StageName = "return", note: str = "cold hall") -> None:
    identity = real_identity(robot, 3)
    with Catalogue() as catalogue:
        for stage in STAGES[: STAGES.index(until) + 1]:
            facts = {**fingerprint(identity, SHA256), "found": f"<{stage}> is well", "channel": "can0"}
            of_run = {"capture": str(capture), "capture_sha256": file_sha256(capture)} if capture else {}
            mine = of_run if stage == "full run" else {}
            run = runs.begin(catalogue, identity, "commission", stage=stage, facts=facts, note=note)
            runs.finish(catalogue, run.id, "completed", **mine)  # type: ignore[arg-type]


def made(label: str = "tx40", source: str | None = None) -> Protocol:
    with Catalogue() as catalogue:
        return protocol_of(catalogue, label, source)


def text_of(pdf: bytes) -> str:
    reader = PdfReader(BytesIO(pdf))
    assert len(reader.pages) == 1
    return reader.pages[0].extract_text()


def test_its_figures_are_those_of_the_recording(tx40: Robot, walked: Path) -> None:
    protocol = made()
    assert protocol.commissioned and not protocol.simulated
    assert protocol.figures_of == f"full run, run {STAGES.index('full run') + 1}"
    assert [row.serial for row in protocol.joints] == [str(n) for n in real_identity(tx40, 3).serials]
    # The positions of the recording are sin(phase / 100 - 0.01) at 1 ms: 10 rad/s at most, 0.01 behind.
    for row, joint in zip(protocol.joints, tx40.joint, strict=True):
        speed, share = row.fastest.split(" ", 1)
        assert float(speed) == pytest.approx(1 / 100 / PERIOD, rel=0.01)
        assert float(share[1:].split("\u00a0")[0]) == pytest.approx(
            100 * float(speed) / joint.velocity, rel=0.01
        )
        assert float(row.following.split()[0]) == pytest.approx(0.01, rel=0.01)
        assert row.following.endswith(f" {joint.unit}")
    strongest = np.abs(tx40.joint_torque(samples(0, 4 * BATCH).control_signal)).max(axis=0)
    assert [float(row.strongest.split(" ")[0]) for row in protocol.joints] == pytest.approx(
        list(strongest), rel=0.01
    )


def test_page_and_paper_say_the_same_on_one_page(walked: Path) -> None:
    protocol = made()
    page, paper = render_protocol(protocol), text_of(pdf_of(protocol))
    assert "&lt;check&gt; is well" in page and "<check> is well" in paper
    for row in protocol.joints:
        for cell in (row.name, row.serial, row.position, row.torque, row.fastest, row.strongest):
            assert cell in page and cell in paper
    for stage in protocol.stages:
        assert stage.finished in page and stage.finished in paper
    for word in ("cold hall", "Commissioned by: name, date, signature", "Approved by", protocol.made):
        assert word in page and word in paper
    assert pdf_of(protocol) == pdf_of(protocol)


def test_what_is_open_is_said(tx40: Robot, armhil: Call, tmp_path: Path) -> None:
    keep(tx40, None, until="slow run")
    code, out, _ = armhil("protocol", "tx40", "--robot", "tx40", "--json", "--out", tmp_path / "p.html")
    answer = json.loads(out)
    assert code == 1 and answer["commissioned"] is False
    assert answer["verdict"] == "Not commissioned: full run has not passed"
    assert [row["state"] for row in answer["stages"]] == [*["passed"] * 6, "open", "locked"]
    assert answer["remarks"][0] == "Open: full run, return."
    assert answer["figures_of"] == "" and answer["joints"][0]["fastest"] == "–"
    page = (tmp_path / "p.html").read_text(encoding="utf-8")
    assert "Not commissioned" in page and "locked" in page


@pytest.mark.parametrize("suffix", ["html", "pdf"])
def test_the_command_writes_it_and_never_over_a_signed_one(
    walked: Path, armhil: Call, tmp_path: Path, suffix: str
) -> None:
    file = tmp_path / "new" / f"mine.{suffix}"
    code, out, _ = armhil("protocol", "tx40", "--out", file)
    assert code == 0 and "every stage up to the full run has passed" in " ".join(out.split())
    first = file.read_bytes()
    code, _, err = armhil("protocol", "tx40", "--out", file)
    assert code == 2 and f"mine-2.{suffix}" in "".join(err.split()) and file.read_bytes() == first


def test_it_rests_on_no_other_recording_and_no_other_description(
    tx40: Robot, walked: Path, armhil: Call, tmp_path: Path
) -> None:
    edited = tmp_path / "edited"
    shutil.copytree(tx40.folder, edited)
    text = (edited / "robot.toml").read_text(encoding="utf-8")
    assert "jerk = " in text
    (edited / "robot.toml").write_text(text.replace("jerk = ", "jerk = 1", 1), encoding="utf-8")
    with pytest.raises(ProtocolError, match=r"is not what arm tx40 was commissioned with: .*robot\.toml"):
        made(source=str(edited))
    assert made(source="tx40").joints == made().joints
    walked.write_bytes(walked.read_bytes() + b"\0")
    with pytest.raises(ProtocolError, match="is not what run 7 recorded"):
        made()
    walked.unlink()
    with pytest.raises(ProtocolError, match=r"`armhil protocol tx40 --robot tx40`"):
        made()
    assert made(source="tx40").figures_of == ""


def test_what_cannot_be_written_is_one_line(tx40: Robot, armhil: Call, tmp_path: Path) -> None:
    code, _, err = armhil("protocol", "tx40", "--out", tmp_path / "p.docx")
    assert code == 2 and "ends in none of .html, .pdf" in err
    code, _, err = armhil("protocol", "tx40")
    assert code == 2 and "is not in the catalogue" in err
    with Catalogue() as catalogue:
        runs.begin(catalogue, real_identity(tx40, 3), "run")
    code, _, err = armhil("protocol", "tx40")
    assert code == 2 and "begin with `armhil commission tx40`" in " ".join(err.split())
    keep(tx40, None)
    (tmp_path / "file").touch()
    code, _, err = armhil("protocol", "tx40", "--robot", "tx40", "--out", tmp_path / "file" / "p.html")
    assert code == 2 and "cannot be written" in err


def test_without_matplotlib_it_says_what_to_install(walked: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(ProtocolError, match=r"-m pip install 'armhil\[pdf\]', or take --out FILE\.html"):
        pdf_of(made())


def crowded(walked: Protocol, times: int) -> Protocol:
    """Texts as long as they can be."""
    words = "a remark of $many words$ " * 12
    joint, stage = walked.joints[0], walked.stages[0]
    long_joint = replace(joint, name="shoulder_pan_joint_of_the_left_arm", serial="4294967295")
    return replace(
        walked,
        joints=(long_joint,) * 7,
        stages=(replace(stage, words=words[:240], who="a.very.long.user.name@department"),) * 8,
        remarks=(words[:240],) * times,
    )


def test_a_crowded_page_stays_one_page_and_nothing_leaves_it(walked: Path) -> None:
    """By a library that is not ours: where each piece of text stands."""
    placed: list[tuple[float, float, str]] = []

    def visit(text: str, page: list[float], line: list[float], *_: object) -> None:
        if text.strip():
            placed.append((page[4] + line[4], page[5] + line[5], text))

    reader = PdfReader(BytesIO(pdf_of(crowded(made(), 6))))
    (page,) = reader.pages
    page.extract_text(visitor_text=visit)
    point = 72.0 / 25.4
    size = float(page.mediabox.width), float(page.mediabox.height)
    assert size == pytest.approx((WIDTH * point, HEIGHT * point), abs=1.0)
    assert len(placed) > 100
    assert min(y for _, y, _ in placed) >= MARGIN / 2 * point - 1
    assert max(y for _, y, _ in placed) <= size[1] - MARGIN * point
    assert sum("$" in text for _, _, text in placed) > 0, "a dollar sign is no formula"
    with pytest.raises(ProtocolError, match=r"no room on one page of PDF; take --out FILE\.html"):
        pdf_of(crowded(made(), 40))


def test_a_day_that_is_the_same_is_said_once() -> None:
    begin = datetime(2026, 11, 23, 8, 5, tzinfo=UTC)
    assert _span(begin, begin + timedelta(hours=2)) == "2026-11-23 08:05 – 10:05 UTC"
    assert _span(begin, begin + timedelta(hours=20)) == "2026-11-23 08:05 UTC – 2026-11-24 04:05 UTC"
