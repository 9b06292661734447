from pathlib import Path

import pytest

from app.links.language_model.api_key import read_api_key, withheld_note

KEY = "sk-very-secret-0123456789"
OPENAI = "https://api.openai.com/v1"
OTHER = "https://models.example/v1"


def test_the_key_of_ippon_goes_to_any_endpoint() -> None:
    for url in (OPENAI, OTHER, "http://127.0.0.1:11434/v1"):
        assert read_api_key({"IPPON_API_KEY": f"{KEY}\n", "OPENAI_API_KEY": "other"}, url) == KEY
        assert read_api_key({}, url) is None


@pytest.mark.parametrize("url", [OPENAI, "https://eu.API.openai.com/v1", "https://openai.com"])
def test_openais_key_goes_to_openai(url: str) -> None:
    assert read_api_key({"OPENAI_API_KEY": KEY, "IPPON_API_KEY": ""}, url) == KEY
    assert withheld_note({"OPENAI_API_KEY": KEY}, url) == ""


@pytest.mark.parametrize(
    "url",
    [
        OTHER,
        "http://127.0.0.1:11434/v1",
        "http://api.openai.com/v1",
        "https://api.openai.com.example/v1",
        "https://notopenai.com/v1",
        "https://openai.com@models.example/v1",
        "https://models.example/api.openai.com/v1",
    ],
)
def test_openais_key_goes_to_no_other_endpoint(url: str) -> None:
    environment = {"OPENAI_API_KEY": KEY}
    assert read_api_key(environment, url) is None
    note = withheld_note(environment, url)
    assert "OPENAI_API_KEY was not sent" in note
    assert "IPPON_API_KEY" in note
    assert KEY not in note
    assert withheld_note({}, url) == ""


def test_openais_key_goes_to_the_address_that_is_named_with_it() -> None:
    environment = {"OPENAI_API_KEY": KEY, "OPENAI_BASE_URL": OTHER}
    assert read_api_key(environment, OTHER) == KEY
    assert read_api_key(environment, "https://models.example.org/v1") is None
    assert read_api_key(environment, OPENAI) == KEY


def test_a_file_goes_before_the_environment(tmp_path: Path) -> None:
    file = tmp_path / "key"
    file.write_text(f"{KEY}\n")
    assert read_api_key({"OPENAI_API_KEY": "other", "IPPON_API_KEY": "third"}, OTHER, file) == KEY
    file.write_text(f"{KEY}\nmore")
    with pytest.raises(ValueError, match="must hold the API key alone"):
        read_api_key({}, OTHER, file)
    with pytest.raises(ValueError, match=r"cannot read the API key from .*absent: FileNotFound"):
        read_api_key({}, OTHER, tmp_path / "absent")
