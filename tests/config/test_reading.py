import os
from pathlib import Path

import pytest

from softslip.config.reading import LARGEST_FILE, read_mapping
from softslip.errors import ConfigError


def refused(path: Path) -> str:
    with pytest.raises(ConfigError) as caught:
        read_mapping(path)
    message = str(caught.value)
    assert message.splitlines() == [message], f"not one line: {message!r}"
    assert message.isprintable(), ascii(message)
    assert message.startswith(f"{path}: "), message
    assert "; " in message, f"no remedy in {message!r}"
    return message


def written(folder: Path, text: str) -> Path:
    path = folder / "case.yaml"
    path.write_text(text, encoding="utf-8", newline="")
    return path


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("a: 1e-3", 1e-3),
        ("a: 1E+3", 1e3),
        ("a: .5", 0.5),
        ("a: '1e-3'", "1e-3"),
        ("a: no", "no"),
        ("a: off", "off"),
        ("a: 1:30", "1:30"),
        ("a: ~", None),
        ("a: true", True),
        ("\ufeffa: 1", 1),
        ("a: 1\r\n", 1),
    ],
)
def test_scalars_mean_what_yaml_1_2_says(tmp_path: Path, text: str, value: object) -> None:
    held = read_mapping(written(tmp_path, text))["a"]
    assert held == value
    assert type(held) is type(value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is empty"),
        ("# only a comment\n", "is empty"),
        ("- a\n- b\n", "has no mapping at the top"),
        ("just words", "has no mapping at the top"),
        ("a: [1, 2", "line 1, column"),
        ("a: 1\n\tb: 2", "line 2, column 1"),
        ("a: 1\n---\nb: 2", "another document"),
        ("%YAML 1.1\n---\na: no", "has a YAML directive"),
        ("a: *b", "line 1, column 4: found undefined alias"),
        ("a: !secret 1", "could not determine a constructor"),
        ("a: !!python/object:os.system x", "could not determine a constructor"),
        ("a: \x07", "is not valid YAML"),
        ("a: 2024-99-99", "is not valid YAML"),
        ("a: !!bool x", "is not valid YAML"),
        ("a: !!int ''", "is not valid YAML"),
        ("a: " + "9" * 5000, "is not valid YAML"),
        ("a: " + "[" * 1500, "is nested too deeply"),
        ("? {a: b}\n: 1", "found unhashable key"),
        ("<<: 3", "line 1, column 1: found a merge key"),
        ("a: &a {b: 1}\nc: {<<: *a}", "line 2, column 5: found a merge key"),
    ],
)
def test_text_that_is_no_mapping_is_refused(tmp_path: Path, text: str, said: str) -> None:
    message = refused(written(tmp_path, text))
    assert said in message, f"{said!r} is not in {message!r}"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a: 1\na: 2", "a: 2 is the second value of this key (line 2, column 1)"),
        (
            "base:\n  wall: {roughness: 0, roughness: 0.5}",
            "base.wall.roughness: 0.5 is the second value of this key (line 2",
        ),
        ("base: {wall: 1, wall: {}}", "base.wall: a group or list is the second"),
        ("axes: [1, {a: 1, a: 2}]", "axes[1].a: 2 is the second"),
        ("k: &k [*k]\na: 1\na: 2", "a: 2 is the second"),
        ('a: 1\na: "\\e[31m"', "a: '\\x1b[31m' is the second"),
        ("1: a\n0x1: b", "line 2, column 1"),
    ],
)
def test_a_key_given_twice_is_refused_with_its_path(tmp_path: Path, text: str, said: str) -> None:
    message = refused(written(tmp_path, text))
    assert said in message, f"{said!r} is not in {message!r}"
    assert "keep one of them" in message


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    assert "does not exist" in refused(tmp_path / "case.yaml")


def test_a_folder_is_refused(tmp_path: Path) -> None:
    assert "is not a file" in refused(tmp_path)


def test_a_pipe_is_refused_and_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "case.yaml")
    assert "is not a file" in refused(tmp_path / "case.yaml")


def test_a_binary_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "case.yaml").write_bytes(b"a: \xff\xfe")
    assert "is not UTF-8 text (byte 3)" in refused(tmp_path / "case.yaml")


def test_a_huge_file_is_refused(tmp_path: Path) -> None:
    assert "is larger than" in refused(written(tmp_path, "#" * (LARGEST_FILE + 1)))


def test_a_file_without_end_is_refused(tmp_path: Path) -> None:
    """The system makes some files up as they are read, and says that they are empty."""
    endless = Path("/proc/self/pagemap")
    if not endless.exists():
        pytest.skip("this system has no such file")
    assert endless.stat().st_size == 0
    (tmp_path / "case.yaml").symlink_to(endless)
    assert "is larger than" in refused(tmp_path / "case.yaml")


def test_the_middle_of_a_very_long_name_is_left_out(tmp_path: Path) -> None:
    path = Path("/", *["long" * 10] * 20, "case.yaml")
    with pytest.raises(ConfigError, match=r"^/long.*\.\.\..*/case\.yaml: ") as caught:
        read_mapping(path)
    assert len(str(caught.value)) < 300


def test_an_unreadable_file_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = written(tmp_path, "a: 1")

    def deny(_: Path, mode: str) -> None:
        raise PermissionError(13, f"Permission denied in mode {mode}")

    monkeypatch.setattr(Path, "open", deny)
    assert "cannot be read (Permission denied in mode rb)" in refused(path)


def test_an_impossible_name_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"file name|does not exist"):
        read_mapping(Path("a\0b.yaml"))
