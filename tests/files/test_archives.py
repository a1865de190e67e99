"""Archives and XML from anywhere: opened whole, or refused with one message and nothing done."""

from __future__ import annotations

import re
import stat
import warnings
import zipfile
from pathlib import Path

import fmpy
import pytest

from imufmu.cosim.description import read_description
from imufmu.files import archives
from imufmu.files.archives import LARGEST_READ, ArchiveError, check_xml, parse_xml, unpack
from imufmu.fmi.archive import open_fmu, read_fmu
from imufmu.fmi.doctor import Level, examine
from support.cosim_stubs import LIBRARY, fake_fmu, model_description, stub, variable, write_zip


def refusal(path: Path, folder: Path) -> str:
    """The message of the refusal, which must leave the folder empty."""
    folder.mkdir(exist_ok=True)
    with pytest.raises(ArchiveError) as caught:
        unpack(path, folder)
    assert list(folder.iterdir()) == []
    assert str(path) in str(caught.value)
    return str(caught.value)


def test_a_harmless_archive_is_unpacked_whole(tmp_path: Path) -> None:
    archive = write_zip(tmp_path / "a.ssp", {"a.txt": "one", "deep/er/b.txt": "two"})
    target = tmp_path / "target"
    target.mkdir()
    unpack(archive, target)
    assert (target / "a.txt").read_text() == "one"
    assert (target / "deep/er/b.txt").read_text() == "two"


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("../evil.txt", "leaves the archive"),
        ("a/../../evil.txt", "leaves the archive"),
        ("/evil.txt", "absolute"),
        ("C:/evil.txt", "absolute"),
        ("C:evil.txt", "absolute"),
        ("..\\evil.txt", "backslash"),
        ("a\\b.txt", "backslash"),
        ("\\\\server\\share\\evil.txt", "backslash"),
        ("evil\x00.txt", "cannot be printed"),
        ("evil\n.txt", "cannot be printed"),
    ],
)
def test_a_member_with_a_dangerous_name_is_refused_by_name(tmp_path: Path, name: str, reason: str) -> None:
    archive = tmp_path / "a.ssp"
    with zipfile.ZipFile(archive, "w") as writer:
        entry = zipfile.ZipInfo("x" * len(name))
        writer.writestr("good.txt", "good")
        writer.writestr(entry, "evil")
    # ZipInfo tidies names: put the dangerous one in afterwards, in both places where a zip holds it.
    archive.write_bytes(archive.read_bytes().replace(b"x" * len(name), name.encode()))
    message = refusal(archive, tmp_path / "target")
    assert reason in message
    assert repr(name) in message
    assert not (tmp_path / "evil.txt").exists()


def test_links_special_files_and_repeated_names_are_refused(tmp_path: Path) -> None:
    for kind in (stat.S_IFLNK, stat.S_IFIFO):
        entry = zipfile.ZipInfo("link")
        entry.external_attr = (kind | 0o777) << 16
        with zipfile.ZipFile(tmp_path / "a.ssp", "w") as writer:
            writer.writestr(entry, "/etc/passwd")
        assert "link or special file" in refusal(tmp_path / "a.ssp", tmp_path / "target")
    with zipfile.ZipFile(tmp_path / "b.ssp", "w") as writer, pytest.warns(UserWarning, match="Duplicate"):
        writer.writestr("same", "one")
        writer.writestr("same", "two")
    assert "twice, with different contents" in refusal(tmp_path / "b.ssp", tmp_path / "target")


def test_an_encrypted_member_is_refused(tmp_path: Path) -> None:
    archive = write_zip(tmp_path / "a.ssp", {"secret": "x"})
    content = bytearray(archive.read_bytes())
    for header, flags in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):  # where each header of a member says so
        content[content.index(header) + flags] |= 1
    archive.write_bytes(content)
    assert "member 'secret' refused: encrypted" in refusal(archive, tmp_path / "target")


def test_a_zip_bomb_is_refused_by_its_declared_size(tmp_path: Path) -> None:
    bomb = tmp_path / "bomb.ssp"
    with zipfile.ZipFile(bomb, "w", zipfile.ZIP_DEFLATED) as writer, writer.open("zeros", "w") as member:
        for _ in range(65):
            member.write(bytes(2**20))
    assert "unpacks to 68,157,440 bytes" in refusal(bomb, tmp_path / "target")


def test_an_archive_of_countless_members_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(archives, "MOST_MEMBERS", 2)
    archive = write_zip(tmp_path / "a.ssp", {"a": "", "b": "", "c": ""})
    assert "3 members" in refusal(archive, tmp_path / "target")


def test_every_truncation_is_refused(tmp_path: Path) -> None:
    whole = fake_fmu(tmp_path / "whole.fmu", [variable("y", "output")]).read_bytes()
    cut = tmp_path / "cut.fmu"
    for length in range(0, len(whole) - 1, 37):
        cut.write_bytes(whole[:length])
        assert "not a zip archive" in refusal(cut, tmp_path / "target")


def test_damage_anywhere_is_an_archive_error_or_harmless(tmp_path: Path) -> None:
    whole = fake_fmu(tmp_path / "whole.fmu", [variable("y", "output")]).read_bytes()
    damaged = tmp_path / "damaged.fmu"
    for at in range(0, len(whole), 3):
        damaged.write_bytes(whole[:at] + bytes([whole[at] ^ 0xFF]) + whole[at + 1 :])
        try:
            read_fmu(damaged)
        except ArchiveError as error:
            assert str(damaged) in str(error)


def test_what_is_no_archive_at_all_is_refused(tmp_path: Path) -> None:
    (tmp_path / "text.fmu").write_text("not a zip")
    for path, reason in ((tmp_path / "none.fmu", "no such file"), (tmp_path / "text.fmu", "not a zip archive")):
        with pytest.raises(ArchiveError, match=reason):
            read_fmu(path)
    with pytest.raises(ArchiveError, match="cannot be read"):
        read_fmu(tmp_path)


ENTITY_BOMB = b"""<?xml version="1.0"?>
<!DOCTYPE a [<!ENTITY b "bbbbbbbbbb"><!ENTITY c "&b;&b;&b;&b;&b;&b;">]>
<a>&c;</a>"""
EXTERNAL_ENTITY = b'<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/passwd">]><a>&x;</a>'
REMOTE_SCHEMA = b'<!DOCTYPE a SYSTEM "http://example.invalid/a.dtd"><a/>'


@pytest.mark.parametrize(
    "content", [ENTITY_BOMB, EXTERNAL_ENTITY, REMOTE_SCHEMA, ENTITY_BOMB.decode().encode("utf-16")]
)
def test_xml_with_a_doctype_is_refused_before_it_is_expanded(content: bytes) -> None:
    with pytest.raises(ArchiveError, match=r"model\.xml, line \d: a DOCTYPE is not allowed"):
        check_xml(content, "model.xml")


@pytest.mark.parametrize("encoding", ["no-such", "GB2312", "shift_jis", "utf-7"])
def test_xml_in_an_encoding_that_cannot_be_read_is_refused_by_name(encoding: str) -> None:
    content = f'<?xml version="1.0" encoding="{encoding}"?><a>\u00e4</a>'.encode("latin-1")
    with pytest.raises(ArchiveError, match=r"^model\.xml: its encoding cannot be read \(.*\); save it as UTF-8$"):
        parse_xml(content, "model.xml")


def test_xml_has_a_size_limit_wherever_it_comes_from(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A small archive must not cost minutes: 60 kB unfold to 60 MB. It is not even unfolded."""
    large = b"<a>" + b" " * LARGEST_READ + b"</a>"
    with pytest.raises(ArchiveError, match=r"model\.xml: more than 16 MB"):
        parse_xml(large, "model.xml")
    with zipfile.ZipFile(tmp_path / "a.fmu", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", large)
    monkeypatch.setattr(zipfile.ZipFile, "read", lambda *_arguments: pytest.fail("read"))
    with pytest.raises(ArchiveError, match=r"a\.fmu: modelDescription\.xml: more than 16 MB"):
        read_fmu(tmp_path / "a.fmu")
    (tmp_path / "a.ssd").write_bytes(large)
    with pytest.raises(ArchiveError, match=r"a\.ssd: more than 16 MB"):
        read_description(tmp_path / "a.ssd")


@pytest.mark.parametrize("method", [zipfile.ZIP_LZMA, zipfile.ZIP_BZIP2, zipfile.ZIP_DEFLATED])
def test_a_member_that_does_not_unpack_is_named_in_one_line(tmp_path: Path, method: int) -> None:
    path = tmp_path / "a.fmu"
    with zipfile.ZipFile(path, "w", method) as archive:
        archive.writestr("modelDescription.xml", XML * 20)
    content = bytearray(path.read_bytes())
    content[60:90] = b"\xff" * 30
    path.write_bytes(content)
    with pytest.raises(ArchiveError, match=r"^.*a\.fmu: modelDescription\.xml cannot be unpacked: .+$"):
        read_fmu(path)


def test_an_archive_too_large_for_the_memory_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def read(*_arguments: object) -> bytes:
        raise MemoryError

    monkeypatch.setattr(zipfile.ZipFile, "read", read)
    path = fake_fmu(tmp_path / "a.fmu", [variable("y", "output")])
    with pytest.raises(ArchiveError, match=r"a\.fmu: modelDescription\.xml cannot be unpacked: MemoryError"):
        read_fmu(path)


def test_of_many_problems_the_first_are_told_and_the_number_of_the_others(tmp_path: Path) -> None:
    variables = [variable(f"y{i}", "output").replace("causality", "cause") for i in range(100)]
    path = write_zip(tmp_path / "a.fmu", {"modelDescription.xml": model_description(variables), LIBRARY: b""})
    with pytest.raises(ArchiveError, match=r"; and \d+ more$") as caught:
        read_fmu(path)
    assert len(str(caught.value)) < 2000


@pytest.mark.parametrize("content", [b"", b"<a>\n<b>\n</a>", b"<a/>\n\n<b/>", b"\xff\xff", b"<a>\n\n&lt</a>"])
def test_malformed_xml_is_refused_with_its_line(content: bytes) -> None:
    with pytest.raises(ArchiveError, match=r"model\.xml, line \d+: not well-formed"):
        parse_xml(content, "model.xml")


def test_an_fmu_is_opened_with_its_library_for_this_platform(tmp_path: Path) -> None:
    library, description = open_fmu(stub("clock"), tmp_path)
    assert library.parent == tmp_path / "binaries" / fmpy.platform
    assert [v.name for v in description.modelVariables][:2] == ["u", "y"]


def test_the_folder_that_names_the_processor_is_preferred(tmp_path: Path) -> None:
    newer = LIBRARY.replace(fmpy.platform, fmpy.platform_tuple)
    for members in ({newer: b""}, {newer: b"", LIBRARY: b""}):
        path = write_zip(tmp_path / "a.fmu", {"modelDescription.xml": XML} | members)
        folder = tmp_path / str(len(members))
        folder.mkdir()
        assert open_fmu(path, folder)[0] == folder / newer


XML = model_description([variable("y", "output")])
UNFIT = {
    "no model description": ({LIBRARY: b""}, "modelDescription.xml is missing"),
    "other root": ({"modelDescription.xml": "<a/>", LIBRARY: b""}, "no FMI model description: the root element is a"),
    "FMI 4": (
        {"modelDescription.xml": XML.replace('fmiVersion="2.0"', 'fmiVersion="4.0"'), LIBRARY: b""},
        r"FMI 4\.0; expected FMI 2\.0 or 3\.0",
    ),
    "schema": (
        {"modelDescription.xml": XML.replace('causality="output"', 'causality="sideways"'), LIBRARY: b""},
        "line .*sideways",
    ),
    "dangling reference": (
        {"modelDescription.xml": XML.replace('index="1"', 'index="7"'), LIBRARY: b""},
        "modelDescription.xml: ",
    ),
    "doctype": (
        {"modelDescription.xml": XML.replace("<fmiModel", "<!DOCTYPE x><fmiModel", 1), LIBRARY: b""},
        "modelDescription.xml, line 2: a DOCTYPE",
    ),
    "no binary": ({"modelDescription.xml": XML}, "no binary for this platform .* it holds none"),
    "other platforms": (
        {"modelDescription.xml": XML, "binaries/amiga/Fake.so": b"", "binaries/sun/Fake.so": b""},
        "it holds amiga, sun",
    ),
    "other binary": (
        {"modelDescription.xml": XML, LIBRARY.replace("Fake", "Other"): b""},
        r"modelIdentifier 'Fake': expected Fake\.\w+, there is Other\.",
    ),
    "identifier that leaves its folder": (
        {"modelDescription.xml": XML.replace('modelIdentifier="Fake"', 'modelIdentifier="../x"'), LIBRARY: b""},
        "modelIdentifier '../x'",
    ),
}


@pytest.mark.parametrize(("members", "reason"), UNFIT.values(), ids=UNFIT)
def test_an_fmu_that_cannot_run_here_is_refused_with_the_reason(
    tmp_path: Path, members: dict[str, bytes | str], reason: str
) -> None:
    path = write_zip(tmp_path / "a.fmu", members)
    with pytest.raises(ArchiveError, match=reason) as caught:
        read_fmu(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize(("prefix", "folders", "told"), [
    ("./", (), "begins with ./"),
    ("", ("documentation/", "documentation/"), "'documentation/' occurs twice"),
    ("", ("extra/same.xml", "extra/same.xml"), "'extra/same.xml' occurs twice"),
    ("", ("documentation/Modelica::Blocks.html",), "has a colon in its name"),
])  # fmt: skip
def test_odd_names_of_members_are_read_and_told(
    tmp_path: Path, prefix: str, folders: tuple[str, ...], told: str
) -> None:
    path = tmp_path / "a.fmu"
    with warnings.catch_warnings(), zipfile.ZipFile(path, "w") as archive:
        warnings.simplefilter("ignore")  # of zipfile, which does not like names to occur twice either
        for name, content in {"modelDescription.xml": XML, LIBRARY: b"library"}.items():
            archive.writestr(prefix + name, content)
        for name in folders:
            archive.writestr(name, b"")
    faults: list[str] = []
    assert read_fmu(path, faults).modelName == "Fake"
    assert len(faults) == 1 and told in faults[0]
    (tmp_path / "to").mkdir()
    library, _ = open_fmu(path, tmp_path / "to")
    assert library.read_bytes() == b"library"


@pytest.mark.parametrize("name", ["C:/a", "./C:a", "/a", "../a"])
def test_names_that_could_leave_the_folder_are_refused(tmp_path: Path, name: str) -> None:
    path = write_zip(tmp_path / "a.fmu", {"modelDescription.xml": XML, LIBRARY: b"", name: b""})
    with pytest.raises(ArchiveError, match=r"refused: (an absolute path|the path leaves the archive)"):
        read_fmu(path, [])


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('<Real start="0"/>', "<Real/>", "has no start value"),
        ('<Real start="0"/>', '<Boolean start="false"/>', 'must have variability != "continuous"'),
        ('<Real start="0"/>', '<Real start="0" unit="furlong"/>', 'The unit "furlong"'),
        ('modelName="Fake"', 'modelName="Fake" mood="good"', "The attribute 'mood' is not allowed"),
    ],
)
def test_faults_of_a_model_description_are_told_to_those_who_ask_and_refused_for_others(
    tmp_path: Path, old: str, new: str, told: str
) -> None:
    text = model_description([variable("y", "output"), variable("k", "input")])
    assert old in text
    path = write_zip(tmp_path / "a.fmu", {"modelDescription.xml": text.replace(old, new), LIBRARY: b""})
    faults: list[str] = []
    assert [v.name for v in read_fmu(path, faults).modelVariables] == ["y", "k"]
    assert len(faults) == 1 and told in faults[0] and str(path) in faults[0]
    with pytest.raises(ArchiveError, match=re.escape(told)):
        read_fmu(path)
    findings = examine(path)
    assert any(finding.level is Level.PROBLEM and told in finding.text for finding in findings)
    assert any("runs it" in finding.text and "with --strict it refuses" in finding.text for finding in findings)
