import importlib.metadata
import tomllib

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from app.doctor import packages
from app.doctor.packages import NOT_STATED, installed_packages, licence_of, purposes
from tests.locations import ROOT


def named_packages():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    extras = project["optional-dependencies"].values()
    texts = [*project["dependencies"], *(text for extra in extras for text in extra)]
    return [Requirement(text) for text in texts]


def test_each_package_that_is_named_has_a_reason_and_no_other():
    assert {canonicalize_name(one.name) for one in named_packages()} == set(purposes())
    assert all(set(said) <= {"for", "versions"} and said["for"] for said in purposes().values())


def test_each_package_has_a_least_version():
    for one in named_packages():
        assert any(bound.operator == ">=" for bound in one.specifier), str(one)


class Distributions:
    """Packages of a Python: name, what each needs, and its licence."""

    def __init__(self, folder, monkeypatch):
        self._folder = folder
        monkeypatch.setattr(importlib.metadata, "distribution", self._distribution)

    def add(self, name, *needs, extras=(), fields=("License-Expression: MIT",), files=()):
        info = self._folder / f"{name.replace('-', '_')}-1.0.dist-info"
        info.mkdir()
        lines = ["Metadata-Version: 2.4", f"Name: {name}", "Version: 1.0", *fields]
        lines += [f"Provides-Extra: {extra}" for extra in extras]
        lines += [f"Requires-Dist: {text}" for text in needs]
        (info / "METADATA").write_text("\n".join(lines) + "\n")
        for path, _ in files:
            (self._folder / path).parent.mkdir(parents=True, exist_ok=True)
            (self._folder / path).touch()
        (info / "RECORD").write_text("".join(f"{path},,{size}\n" for path, size in files))

    def _distribution(self, name):
        info = self._folder / f"{name.replace('-', '_')}-1.0.dist-info"
        if not info.exists():
            raise importlib.metadata.PackageNotFoundError(name)
        return importlib.metadata.Distribution.at(info)


@pytest.fixture
def distributions(tmp_path, monkeypatch):
    return Distributions(tmp_path, monkeypatch)


def by_name():
    return {one.name: one for one in installed_packages()}


def test_what_is_needed_is_listed_with_who_needs_it(distributions, monkeypatch):
    monkeypatch.setattr(packages, "purposes", lambda: {"numpy": {"for": "all arrays"}})
    distributions.add("ippon", "NumPy>=2", "typing_extensions; python_version < '3'")
    distributions.add("numpy", "blas", "windows-only; sys_platform == 'win32'")
    distributions.add("blas", "numpy")
    distributions.add("windows-only")
    distributions.add("typing-extensions")
    found = by_name()
    assert list(found) == ["ippon", "numpy", "blas"]
    assert found["numpy"].purpose == "all arrays"
    assert (found["blas"].purpose, found["blas"].needed_by) == ("", ["numpy"])
    assert found["numpy"].extras == []


def test_extras_count_where_they_are_installed(distributions):
    needs = ["numpy", "torch; extra == 'networks'", "ray; extra == 'ray'", "numpy; extra == 'ray'"]
    distributions.add("ippon", *needs, extras=["networks", "ray"])
    distributions.add("numpy")
    distributions.add("torch", "hub[fast]; extra == 'never'", "files[fast]")
    distributions.add("files", "zipper; extra == 'fast'", "torch; extra == 'fast'", extras=["fast"])
    distributions.add("zipper")
    found = by_name()
    assert set(found) == {"ippon", "numpy", "torch", "files", "zipper"}
    assert (found["torch"].extras, found["numpy"].extras) == (["networks"], [])
    assert found["zipper"].needed_by == ["files"]


def test_sizes_and_texts_come_from_the_list_of_files(distributions):
    files = [
        ("numpy/core.so", 3_000_000),
        ("numpy/licenses.py", 100_000),
        ("numpy-1.0.dist-info/licenses/LICENSE.txt", 900),
    ]
    distributions.add("ippon", "numpy")
    distributions.add("numpy", files=files)
    numpy = by_name()["numpy"]
    assert numpy.megabytes == 3.1
    (text,) = numpy.texts
    assert text.endswith("numpy-1.0.dist-info/licenses/LICENSE.txt")


@pytest.mark.parametrize(
    ("fields", "licence"),
    [
        (["License-Expression: MIT OR Apache-2.0", "License: other"], "MIT OR Apache-2.0"),
        (["License: text", "Classifier: License :: OSI Approved :: BSD License"], "BSD License"),
        (["Classifier: License :: OSI Approved :: ISC License (ISCL)"], "ISC License (ISCL)"),
        (["License: Apache 2.0"], "Apache 2.0"),
        (
            [
                "License: MIT OR Apache-2.0",
                "Classifier: License :: OSI Approved :: MIT License",
                "Classifier: License :: OSI Approved :: Apache Software License",
            ],
            "MIT OR Apache-2.0",
        ),
        (
            [
                "Classifier: License :: OSI Approved :: MIT License",
                "Classifier: License :: OSI Approved :: BSD License",
            ],
            "MIT License, BSD License",
        ),
        (
            [
                "Classifier: License :: DFSG approved",
                "Classifier: License :: OSI Approved :: MIT License",
            ],
            "MIT License",
        ),
        (["License: The MIT License", "  Permission is hereby granted"], "The MIT License"),
        (["Classifier: Programming Language :: Python"], NOT_STATED),
        ([], NOT_STATED),
    ],
)
def test_a_licence_is_what_the_package_states(distributions, fields, licence):
    distributions.add("some", fields=fields)
    assert licence_of(importlib.metadata.distribution("some")) == licence


def test_a_checkout_that_is_not_installed_says_so(distributions):
    with pytest.raises(packages.NotInstalledError, match="pip install"):
        installed_packages()


def test_every_package_of_this_python_is_for_something():
    found = installed_packages()
    assert found[0].name == "ippon"
    assert all(one.purpose or one.needed_by for one in found)
    named = {one.name for one in found if one.purpose}
    assert {"numpy", "numba", "viser", "eclipse-zenoh", "pytest"} <= named
