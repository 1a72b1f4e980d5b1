"""Settings: defaults, files, overrides, and what is said when they are wrong."""

from __future__ import annotations

from pathlib import Path

import pytest

from scan2bim.config import UNITS, Settings, load_settings, settings_toml
from scan2bim.errors import UsageError


def write(folder: Path, text: str) -> Path:
    path = folder / "settings.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_no_file_gives_the_defaults() -> None:
    assert load_settings() == Settings()


def test_a_value_of_the_file_is_taken_and_an_override_goes_before_it(tmp_path: Path) -> None:
    path = write(tmp_path, '[frame]\nunit = "mm"\nup = "y"\n')
    settings = load_settings(path, {"frame": {"unit": "ft"}})
    assert (settings.frame.unit, settings.frame.up) == ("ft", "y")
    assert settings.frame.metres_per_unit == pytest.approx(0.3048)


def test_an_unknown_key_is_refused_with_the_nearest_known_name(tmp_path: Path) -> None:
    path = write(tmp_path, '[frame]\nunits = "mm"\n')
    with pytest.raises(UsageError, match=r"unknown setting 'frame.units'. Did you mean 'frame.unit'\?") as caught:
        load_settings(path)
    assert str(path) in str(caught.value)


def test_an_unknown_section_is_refused_with_the_nearest_known_name(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"unknown setting 'opening'. Did you mean 'openings'\?"):
        load_settings(write(tmp_path, "[opening]\n"))


def test_a_key_in_the_wrong_section_is_sent_to_the_right_one(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"Did you mean 'frame.unit'\?"):
        load_settings(write(tmp_path, 'unit = "mm"\n'))


def test_all_wrong_settings_are_named_at_once(tmp_path: Path) -> None:
    with pytest.raises(UsageError) as caught:
        load_settings(write(tmp_path, '[frame]\nunit = "furlong"\nup = 3\n'))
    text = str(caught.value)
    assert "'frame.unit': expected one of m, dm, cm, mm, km, in, ft, us-ft, but got \"furlong\"" in text
    assert "'frame.up': expected" in text
    assert "got 3" in text


@pytest.mark.parametrize("text", ["[frame", "unit: mm", "frame = 3"])
def test_a_file_that_is_no_toml_or_has_no_sections_is_refused(tmp_path: Path, text: str) -> None:
    path = write(tmp_path, text)
    with pytest.raises(UsageError, match=r"settings\.toml"):
        load_settings(path, {"frame": {"unit": "mm"}})


def test_a_missing_file_and_a_binary_file_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no such settings file"):
        load_settings(tmp_path / "none.toml")
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"\xff\xfe\x00\x81")
    with pytest.raises(UsageError, match="cannot be read"):
        load_settings(binary)


def test_written_settings_are_read_back_the_same(tmp_path: Path) -> None:
    settings = load_settings(None, {"frame": {"unit": "us-ft", "up": "-z"}})
    assert load_settings(write(tmp_path, settings_toml(settings))) == settings
    assert load_settings(write(tmp_path, settings_toml(Settings()))) == Settings()


def test_every_setting_says_what_it_is() -> None:
    for section in Settings.model_fields:
        values = getattr(Settings(), section)
        for name, info in type(values).model_fields.items():
            assert info.description, f"{section}.{name} has no description"


def test_units_are_metres_per_unit() -> None:
    assert UNITS["mm"] == 0.001
    assert UNITS["us-ft"] == pytest.approx(0.3048006096)
