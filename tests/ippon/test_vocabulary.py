"""Labels have one spelling."""

import unicodedata

import pytest

from ippon.vocabulary import canonical_label


@pytest.mark.parametrize("text", ["Loeffel", "Löffel", "Café-Tisch", "tè"])
def test_a_label_is_the_same_however_its_letters_were_typed(text):
    composed, decomposed = (unicodedata.normalize(form, text) for form in ("NFC", "NFD"))
    assert canonical_label(composed) == canonical_label(decomposed)


def test_words_are_joined():
    assert canonical_label(" Chest of-Drawers ") == "chest_of_drawers"
