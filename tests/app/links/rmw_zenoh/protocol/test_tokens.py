import contextlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.links.rmw_zenoh.protocol.tokens import (
    Entity,
    Qos,
    decode_qos,
    encode_qos,
    read_token,
    token_of,
)
from tests.app.links.rmw_zenoh.protocol.published import (
    ADD_CLIENT,
    ADD_KEY,
    ADD_SERVER,
    CAPTURED_TOKEN,
    CHATTER_KEY,
    LISTENER,
    LISTENER_CHATTER,
    STRING_HASH,
    TALKER_CHATTER,
)

NAMES = st.from_regex(r"[a-z][a-z0-9_]{0,8}", fullmatch=True)
QOS = st.builds(
    Qos,
    reliable=st.booleans(),
    transient_local=st.booleans(),
    keep_all=st.booleans(),
    depth=st.integers(0, 2**31),
)


@pytest.mark.parametrize(
    "token",
    [LISTENER, LISTENER_CHATTER, TALKER_CHATTER, ADD_SERVER, ADD_CLIENT, CAPTURED_TOKEN],
)
def test_published_tokens_are_read_and_written_again(token):
    assert token_of(read_token(token)) == token


def test_what_a_published_token_says():
    assert read_token(TALKER_CHATTER) == Entity(
        domain=2,
        session="8b20917502ee955ac4476e0266340d5c",
        node_id=0,
        entity_id=10,
        kind="MP",
        node="talker",
        topic="/chatter",
        type="std_msgs/msg/String",
        type_hash=STRING_HASH,
        qos=Qos(depth=7),
    )
    assert read_token(CAPTURED_TOKEN).key == CHATTER_KEY
    assert read_token(ADD_SERVER).key == ADD_KEY
    assert read_token(LISTENER).full_name == "/listener"


def test_parts_of_newer_versions_are_ignored():
    assert read_token(f"{TALKER_CHATTER}/cpu").topic == "/chatter"


@pytest.mark.slow
@given(
    st.integers(0, 232), NAMES, st.lists(NAMES, max_size=3), st.lists(NAMES, min_size=1), NAMES, QOS
)
def test_any_entity_comes_back(domain, node, namespace, topic, enclave, qos):
    entity = Entity(
        domain=domain,
        session="5a",
        node_id=3,
        entity_id=14,
        kind="MS",
        namespace="/" + "/".join(namespace),
        node=node,
        enclave=enclave,
        topic="/" + "/".join(topic),
        type="sensor_msgs/msg/Image",
        type_hash=STRING_HASH,
        qos=qos,
    )
    assert read_token(token_of(entity)) == entity


@pytest.mark.parametrize(
    ("qos", "text"),
    [
        (Qos(depth=10), "::,10:,:,:,,"),
        (Qos(), "::,:,:,:,,"),
        (Qos(reliable=False, depth=5), "2::,5:,:,:,,"),
        (Qos(transient_local=True, depth=1), ":1:,1:,:,:,,"),
        (Qos(keep_all=True), "::2,:,:,:,,"),
    ],
)
def test_quality_of_service_as_other_programs_write_it(qos, text):
    assert encode_qos(qos) == text
    assert decode_qos(text) == qos


def test_explicit_defaults_and_deadlines_are_read():
    assert decode_qos("1:2:1,7:3,500:,:1,2,0") == Qos(depth=7)
    assert decode_qos("0:0:0,7:,:,:,,") == Qos(depth=7)


@pytest.mark.parametrize(
    "token",
    [
        "",
        "ippon/status",
        "@ros2_lv/0/5a/0/0/NN/%/%",
        "@ros2_lv/0/5a/0/0/XX/%/%/node",
        "@ros2_lv/x/5a/0/0/NN/%/%/node",
        "@ros2_lv/0/5a/0/0/MP/%/%/node/%chatter/std_msgs::msg::dds_::String_/hash",
        "@ros2_lv/0/5a/0/0/MP/%/%/node/%chatter/std_msgs::msg::dds_::String_/hash/depth 10",
        "@ros2_lv/0/5a/0/0/NN//%/node",
    ],
)
def test_what_is_no_token_is_refused(token):
    with pytest.raises(ValueError, match="rmw_zenoh"):
        read_token(token)


@given(st.text(max_size=60))
def test_any_text_is_read_or_refused(text):
    for token in (
        text,
        f"@ros2_lv/{text}",
        f"@ros2_lv/0/5a/0/0/MP/%/%/n/%t/p::m::dds_::T_/h/{text}",
    ):
        with contextlib.suppress(ValueError):
            read_token(token)


def test_keys_of_a_token_agree_with_another_program():
    ros2 = pytest.importorskip("pamoja.ros2")
    entity = read_token(LISTENER_CHATTER)
    assert entity.key == ros2.entity_key(2, entity.topic, entity.type, entity.type_hash)
