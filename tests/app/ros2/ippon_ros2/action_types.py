"""Builds the Python package `nav2_msgs` with the action NavigateToPose; run by ROS 2's Python.

PyPI has no wheel of nav2_msgs. ROS 2's own generators, which are there as wheels, make it from the
definition of the action's fields; the system's compiler makes its libraries. Takes about 15 s,
so the result is kept: `action_types.py FOLDER` does nothing where it is complete.
"""

import json
import os
import subprocess
import sys
import sysconfig
from pathlib import Path

PREFIX = Path(sys.prefix)
PACKAGE = "nav2_msgs"
DEPENDENCIES = (
    "action_msgs", "builtin_interfaces", "geometry_msgs", "service_msgs", "std_msgs",
    "unique_identifier_msgs",
)  # fmt: skip
DEFINITION = """\
geometry_msgs/PoseStamped pose
string behavior_tree
---
uint16 NONE=0
uint16 error_code
string error_msg
---
geometry_msgs/PoseStamped current_pose
builtin_interfaces/Duration navigation_time
builtin_interfaces/Duration estimated_time_remaining
int16 number_of_recoveries
float32 distance_remaining
"""
VISIBILITY = (
    "#define ROSIDL_{0}_{1}\n#define ROSIDL_{0}_EXPORT_{1}\n#define ROSIDL_{0}_IMPORT_{1}\n"
)


def main():
    folder = Path(sys.argv[1])
    done = folder / PACKAGE / "complete"
    made_of = f"{PREFIX}\n{DEFINITION}"
    if done.exists() and done.read_text() == made_of:
        return
    os.environ["AMENT_PREFIX_PATH"] = str(PREFIX)
    generate(folder)
    build(folder)
    done.write_text(made_of)


def generate(folder):
    from rosidl_adapter.action import convert_action_to_idl
    from rosidl_generator_c import generate_c
    from rosidl_generator_py import generate_py
    from rosidl_generator_type_description import generate_type_hash
    from rosidl_typesupport_c import generate_c as generate_dispatch
    from rosidl_typesupport_fastrtps_c import generate_typesupport_fastrtps_c

    package = folder / PACKAGE
    (package / "action").mkdir(parents=True, exist_ok=True)
    (package / "action" / "NavigateToPose.action").write_text(DEFINITION)
    convert_action_to_idl(
        package, PACKAGE, Path("action/NavigateToPose.action"), package / "action"
    )
    arguments = folder / "arguments.json"
    share = PREFIX / "share"

    def write(generator):
        values = {
            "package_name": PACKAGE,
            "output_dir": str(package),
            "template_dir": str(share / generator / "resource"),
            "idl_tuples": [f"{package}:action/NavigateToPose.idl"],
            "include_paths": [f"{name}:{share / name}" for name in DEPENDENCIES],
            "type_description_tuples": [
                f"action/NavigateToPose.idl:{package}/action/NavigateToPose.json"
            ],
            "ros_interface_dependencies": [
                f"{name}:{path}" for name in DEPENDENCIES for path in (share / name).rglob("*.idl")
            ],
            "target_dependencies": [],
        }
        arguments.write_text(json.dumps(values))
        return str(arguments)

    (package / "__init__.py").write_text("")
    generate_type_hash(write("rosidl_generator_type_description"))
    generate_c(write("rosidl_generator_c"))
    generate_typesupport_fastrtps_c(write("rosidl_typesupport_fastrtps_c"))
    generate_dispatch(write("rosidl_typesupport_c"), ["rosidl_typesupport_fastrtps_c"])
    generate_py(write("rosidl_generator_py"), ["rosidl_typesupport_c"])
    for header, name in (
        ("rosidl_generator_c", "GENERATOR_C_PUBLIC"),
        ("rosidl_typesupport_fastrtps_c", "TYPESUPPORT_FASTRTPS_C_PUBLIC"),
    ):
        kind, _, access = name.rpartition("_")
        text = VISIBILITY.replace("_EXPORT", f"_{access}").format(kind, PACKAGE)
        (package / "msg" / f"{header}__visibility_control.h").parent.mkdir(exist_ok=True)
        (package / "msg" / f"{header}__visibility_control.h").write_text("#pragma once\n" + text)


def build(folder):
    """Compile everything into the extension that the generated Python imports."""
    package = folder / PACKAGE
    sources = [*package.rglob("*.c"), *package.rglob("*.cpp")]
    include = [
        folder,
        PREFIX / "include",
        *(PREFIX / "include").iterdir(),
        sysconfig.get_paths()["include"],
    ]
    numpy_include = subprocess.run(
        [sys.executable, "-c", "import numpy; print(numpy.get_include())"],
        check=True, capture_output=True, text=True,
    ).stdout.strip()  # fmt: skip
    flags = ["-O0", "-fPIC", "-w", *(f"-I{path}" for path in (*include, numpy_include))]
    objects = []
    for source in sources:
        objects.append(source.with_suffix(".o"))
        compiler = "g++" if source.suffix == ".cpp" else "gcc"
        subprocess.run([compiler, *flags, "-c", str(source), "-o", str(objects[-1])], check=True)
    kinds = ("generator_c", "generator_py", "typesupport_c", "typesupport_fastrtps_c")
    libraries = [
        path.stem.removeprefix("lib")
        for name in DEPENDENCIES
        for kind in kinds
        if (path := PREFIX / "lib" / f"lib{name}__rosidl_{kind}.so").exists()
    ]
    libraries += ["rosidl_runtime_c", "rosidl_typesupport_c", "rosidl_typesupport_fastrtps_c",
                  "rosidl_typesupport_fastrtps_cpp", "fastcdr", "rcutils"]  # fmt: skip
    extension = package / f"{PACKAGE}_s__rosidl_typesupport_c.so"
    subprocess.run(
        ["g++", "-shared", "-o", str(extension), *map(str, objects), f"-L{PREFIX / 'lib'}",
         f"-Wl,-rpath,{PREFIX / 'lib'}", *(f"-l{name}" for name in libraries)],
        check=True,
    )  # fmt: skip


if __name__ == "__main__":
    main()
