import subprocess
import sys
import unicodedata

import pytest

from ippon.guidance.language.languages import other_language


@pytest.mark.parametrize(
    ("sentence", "language"),
    [
        ("suche meinen Hut auf dem Sofa", "German"),
        ("Find mein Hut", "German"),
        ("la table basse", "French"),
        ("¿Dónde está mi sombrero?", "Spanish"),
        ("trova le mie chiavi", "Italian"),
        ("waar is mijn hoed", "Dutch"),
        ("onde está o meu chapéu", "Portuguese"),
        ("gdzie jest mój kapelusz", "Polish"),
        ("anahtarlarımı bul lütfen", "Turkish"),
        ("帽子はどこですか", "Japanese"),
        ("내 모자 어디 있어", "Korean"),
        ("где моя шляпа", "a language in Cyrillic script"),
        ("Such den Ball", "German"),
        ("il laptop in camera", "Italian"),
        ("no encuentro el cargador del móvil", "Spanish"),
        ("Qayerda mening qalpog'im bor ekan", "another language than English"),
    ],
)
def test_other_languages(sentence: str, language: str) -> None:
    assert other_language(sentence) == language


@pytest.mark.parametrize(
    "sentence",
    [
        "Hut",
        "hat",
        "quokka",
        "flurbl gadget",
        "the café table",
        "crème brûlée dish",
        "no hat",
        "find my die",
        "the Le Creuset pot",
        "a la carte menu",
        "the den lamp",
        "my LA cap",
        "find sofa on tv",
        "phone on sofa",
        "😀",
        "",
    ],
)
def test_what_may_be_english(sentence: str) -> None:
    assert other_language(sentence) == ""


def test_decomposed_letters_are_no_other_language() -> None:
    assert other_language(unicodedata.normalize("NFD", "find Zoë's mug")) == ""


def test_my_son_is_english() -> None:
    assert other_language("find my son") == ""


@pytest.mark.slow
def test_the_language_does_not_depend_on_the_order_of_a_set() -> None:
    code = (
        "from ippon.guidance.language.languages import other_language;"
        "print(other_language('przynieś mi back?'))"
    )
    said = {
        subprocess.run(
            [sys.executable, "-c", code],
            env={"PYTHONHASHSEED": str(seed), "PYTHONPATH": ":".join(sys.path)},
            capture_output=True,
            check=True,
        ).stdout
        for seed in range(4)
    }
    assert len(said) == 1
