"""CLIP's byte-pair encoding, beside the tokenizer of the `transformers` library."""

import gzip

import numpy as np
import pytest

from ippon.segmentation.errors import CheckpointError
from tests import later

# torch and transformers take seconds to load.
pytestmark = pytest.mark.slow

later.needs("regex", "transformers", extra="segmentation")
transformers = later.module("transformers")
tokenizer = later.module("ippon.segmentation.backends.san.tokenizer")
ClipTokenizer, _byte_symbols = later.names(
    "ippon.segmentation.backends.san.tokenizer", "ClipTokenizer", "_byte_symbols"
)

FEW = (
    ("c", "h"), ("a", "i"), ("ai", "r</w>"), ("ch", "air</w>"), ("o", "f</w>"), ("s", "o"),
    ("so", "f"), ("sof", "a</w>"), ("p", "h"), ("ph", "o"), ("t", "o</w>"), ("pho", "to</w>"),
    ("0", "0"), ("Ã", "©"),
)  # fmt: skip
TEXTS = ("a photo of a chair.", "SOFA", "chairs  of\tsofas", "don't 100% café é", "", "日本 x_y")


def peer(tmp_path):
    symbols = list(_byte_symbols().values())
    tokens = [*symbols, *(s + "</w>" for s in symbols), *("".join(pair) for pair in FEW)]
    tokens += ["<|startoftext|>", "<|endoftext|>"]
    vocabulary = {token: k for k, token in enumerate(tokens)}
    return transformers.CLIPTokenizer(vocab=vocabulary, merges=[tuple(pair) for pair in FEW])


def test_it_agrees_with_transformers(tmp_path):
    theirs, ours = peer(tmp_path), ClipTokenizer(FEW)
    for text in TEXTS:
        numbers = theirs(text)["input_ids"]
        row = ours.encode([text])[0]
        assert row[: len(numbers)].tolist() == numbers, text
        assert not row[len(numbers) :].any()


def test_words_become_the_longest_merges():
    few = ClipTokenizer(FEW)
    row = few.encode(["chair"])[0]
    assert row[:4].tolist() == [
        few.start,
        512 + FEW.index(("ch", "air</w>")),
        few.end,
        0,
    ]


def test_long_texts_are_cut_and_still_end():
    few = ClipTokenizer(FEW)
    row = few.encode(["sofa " * 100])[0]
    assert row.shape == (77,)
    assert (row[0], row[-1]) == (few.start, few.end)


def test_both_forms_of_the_file_are_read(tmp_path):
    lines = ["#version: 0.2", *(" ".join(pair) for pair in FEW)]
    lines += [f"x{k} y{k}" for k in range(tokenizer.MERGES + 300 - len(FEW))]
    text = "\n".join(lines)
    (tmp_path / "merges.txt").write_text(text)
    (tmp_path / "bpe_simple_vocab_16e6.txt.gz").write_bytes(gzip.compress(text.encode()))
    first = ClipTokenizer.load(tmp_path / "merges.txt").encode(["a chair"])
    second = ClipTokenizer.load(tmp_path / "bpe_simple_vocab_16e6.txt.gz").encode(["a chair"])
    np.testing.assert_array_equal(first, second)
    # CLIP numbers its tokens up to these, whatever the file holds beyond.
    assert first[0, 0] == 49406
    assert 49407 in first[0]


def test_files_without_a_list_of_merges_are_rejected(tmp_path):
    short, broken = tmp_path / "merges.txt", tmp_path / "x.txt.gz"
    short.write_text("#version\na b\n")
    broken.write_bytes(b"no gzip")
    with pytest.raises(CheckpointError, match=f"has 1 merges; CLIP's list has {tokenizer.MERGES}"):
        ClipTokenizer.load(short)
    with pytest.raises(CheckpointError, match="cannot read CLIP's merges"):
        ClipTokenizer.load(broken)
    with pytest.raises(CheckpointError, match="No such file"):
        ClipTokenizer.load(tmp_path / "nosuch.txt")
