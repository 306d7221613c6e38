"""Key frames in the document, and the values between them."""

from __future__ import annotations

import numpy as np
import pytest

from nodegraph import animation, data, links, workspace
from nodegraph.animation import EASINGS, Key, Span, Track, mixed
from nodegraph.camera_path import orbit
from nodegraph.errors import ParameterError
from nodegraph.network import Network
from nodegraph.subjects import cameras_of, subject_of, things_of
from nodegraph.variable_commands import AddVariable


@pytest.fixture
def network() -> Network:
    net = Network()
    net.add("source.synthetic", "made")
    net.add("render.raycast", "raycast")
    net.add("render.slice", "slice")
    net.add("output.view", "view")
    net.add("output.view", "cut")
    net.connect("made.volume", "raycast.volume")
    net.connect("made.volume", "slice.volume")
    net.connect("raycast.image", "view.image")
    net.connect("slice.image", "cut.image")
    net.link("raycast.camera", "camera")
    net.link("view.camera", "camera")
    return net


def write(net: Network, target: str, *keys: Key) -> None:
    net.history.do(animation.write_track(net, Track(target, keys)))


def test_every_easing_leaves_at_its_key_and_arrives_at_the_next() -> None:
    for name, easing in EASINGS.items():
        track = Track("a.b", (Key(10, 1.0, name), Key(20, 3.0)))
        assert track.at(10) == 1.0
        assert track.at(20) == 3.0
        values = [easing(t) for t in np.linspace(0, 1, 50)]
        assert values == sorted(values)
        assert values[0] == 0.0
    assert Track("a.b", (Key(10, 1.0), Key(20, 3.0))).at(0) == 1.0
    assert Track("a.b", (Key(10, 1.0), Key(20, 3.0))).at(99) == 3.0
    assert Track("a.b", (Key(0, 1.0, "linear"), Key(4, 3.0))).at(1) == 1.5


@pytest.mark.parametrize(
    ("a", "b", "middle"),
    [
        (1.0, 3.0, 2.0),
        (-1e308, 1e308, 0.0),
        (0, 3, 2),
        ((0.0, 4.0), (2.0, 0.0), (1.0, 2.0)),
        (((0.0, 0.0), (1.0, 1.0)), ((1.0, 1.0), (2.0, 2.0)), ((0.5, 0.5), (1.5, 1.5))),
        (True, False, True),
        ("linear", "nearest", "linear"),
        (None, ((0.0,), (1.0,)), None),
    ],
)
def test_what_is_made_of_numbers_mixes_and_all_else_waits(a: object, b: object, middle: object) -> None:
    assert mixed(a, b, 0.0) == a
    assert mixed(a, b, 0.5) == middle
    assert type(mixed(a, b, 0.5)) is type(middle)


def test_planes_turn_and_objects_mix_by_their_numbers() -> None:
    plane = mixed(data.Plane((0, 0, 0), (0, 0, 1)), data.Plane((2, 0, 0), (0, 1, 0)), 0.5)
    np.testing.assert_allclose(plane.unit_normal, [0, 0.5**0.5, 0.5**0.5])
    assert plane.origin == (1.0, 0.0, 0.0)
    light = mixed(data.Light(intensity=1.0), data.Light(intensity=2.0), 0.25)
    assert light.intensity == 1.25
    a = data.TransferFunction([(0.0, (0, 0, 0), 0.0), (1.0, (1, 1, 1), 1.0)])
    b = data.TransferFunction([(0.0, (0, 0, 0), 0.5), (3.0, (1, 0, 1), 0.0)])
    middle = mixed(a, b, 0.5)
    assert middle.to_json()["keys"][1] == [2.0, [1.0, 0.5, 1.0], 0.5]
    assert mixed(a, data.TransferFunction([(0.0, (0, 0, 0), 1.0)]), 0.5) == a
    ends = [data.Gaussian((at, 4.0), (1.0, 1.0), (1.0, at / 2, 0.0), 0.5) for at in (0.0, 2.0)]
    first, last = (data.TransferFunction2D([area]) for area in ends)
    assert mixed(first, last, 0.5) == data.TransferFunction2D([ends[0]._replace(center=(1.0, 4.0), color=(1, 0.5, 0))])


def test_keys_live_in_the_document_and_are_undone(network: Network) -> None:
    assert animation.tracks_of(network) == []
    write(network, "slice.height", Key(0, 10.0), Key(50, 20.0, "linear"))
    network.history.do(animation.write_span(Span(0, 50, 30)))
    again = workspace.loads(workspace.dumps(network))
    assert animation.tracks_of(again) == animation.tracks_of(network)
    assert animation.span_of(again) == Span(0, 50, 30)
    network.rename("slice", "section")
    assert [track.target for track in animation.tracks_of(network)] == ["section.height"]
    network.group("section", id="inside")
    assert [track.target for track in animation.tracks_of(network)] == ["inside/section.height"]
    for _ in range(4):
        network.undo()
    assert animation.tracks_of(network) == []
    assert "animation" not in workspace.dumps(network)


def test_a_track_without_keys_leaves_nothing_behind(network: Network) -> None:
    before = workspace.dumps(network)
    write(network, "slice.height", Key(0, 10.0))
    write(network, "slice.height")
    assert workspace.dumps(network) == before


def test_moves_set_what_differs_and_count_frames(network: Network) -> None:
    write(network, "slice.height", Key(0, 10.0, "linear"), Key(10, 20.0))
    network.history.do(AddVariable("frame", "Int", 0))
    for frame in (0, 5, 10):
        for command in animation.moves(network, frame, animation.tracks_of(network)):
            command.apply(network)
        assert network.get("slice.height") == 10.0 + frame
        assert network.get("frame") == frame
        assert animation.moves(network, frame, animation.tracks_of(network)) == []


def test_one_variable_has_one_track(network: Network) -> None:
    write(network, "view.camera", Key(0, network.get("camera")))
    assert animation.track_of(network, "raycast.camera").target == "view.camera"
    assert animation.track_of(network, "slice.height").keys == ()
    assert animation.shared_place(network, "raycast.camera") == animation.shared_place(network, "view.camera")


def test_a_turntable_turns_evenly_and_closes(network: Network) -> None:
    camera = network.get("camera")
    track = animation.turntable("view.camera", camera, 0, 35)
    for frame in range(36):
        np.testing.assert_allclose(track.at(frame).eye, orbit(camera, 10.0 * frame).eye, atol=1e-6)
    np.testing.assert_allclose(track.at(36).eye, camera.eye, atol=1e-9)


@pytest.mark.parametrize(
    ("told", "word"),
    [
        ({"height": 3}, "list of at least one key"),
        ({"height": [[0, 1.0]]}, "expected a key"),
        ({"height": [[0, 1.0, "bouncy"]]}, "no such easing"),
        ({"height": [[0, "wide", "smooth"]]}, "at frame 0"),
        ({"height": [[5, 1.0, "smooth"], [5, 2.0, "smooth"]]}, "must rise"),
        ({"hight": [[0, 1.0, "smooth"]]}, "no such parameter"),
        ([], "ui.animation"),
    ],
)
def test_what_cannot_be_used_is_named(network: Network, told: object, word: str) -> None:
    network.node("slice").ui["animation"] = told
    with pytest.raises(ParameterError, match=word):
        animation.tracks_of(network)


@pytest.mark.parametrize("told", [3, {"frames": [5]}, {"frames": [9, 2]}, {"rate": 0}, {"rate": "fast"}])
def test_frames_that_make_no_sense_are_refused(network: Network, told: object) -> None:
    network.ui["animation"] = told
    with pytest.raises(ParameterError, match=r"ui\.animation"):
        animation.span_of(network)


# -- what a view is about ---------------------------------------------------------------------------------------------


def test_a_view_moves_the_camera_that_it_shares(network: Network) -> None:
    assert subject_of(network, "view").cameras == ("view.camera",)
    network.unlink("view.camera")
    assert subject_of(network, "view").cameras == ("raycast.camera",)
    assert things_of(network, "view") == ["made.volume"]


def test_cameras_that_stand_at_one_place_move_together(network: Network) -> None:
    network.unlink("view.camera")
    network.unlink("raycast.camera")
    network.add("render.entry_exit_points", "rays")
    network.add("geometry.proxy_box", "proxy")
    network.connect("made.volume", "proxy.volume")
    network.connect("proxy.geometry", "rays.geometry")
    network.connect("rays.interval", "raycast.interval")
    network.set("rays.camera", network.get("raycast.camera"))
    assert cameras_of(network, "view") == ["raycast.camera", "rays.camera"]
    network.set("rays.camera", data.Camera((1, 2, 3), (9, 9, 9)))
    assert cameras_of(network, "view") == ["raycast.camera"]


def test_a_camera_that_follows_an_expression_is_left_alone(network: Network) -> None:
    network.unlink("view.camera")
    network.history.do(AddVariable("other", "Camera", data.Camera()))
    network.derive("camera", "other")
    assert links.value_of(network, "raycast.camera") == data.Camera()
    assert cameras_of(network, "view") == []


def test_a_cut_is_about_its_plane(network: Network) -> None:
    subject = subject_of(network, "cut")
    assert (subject.plane, subject.window, subject.height) == ("slice.plane", "slice.window", "slice.height")
    assert subject.source == "made.volume"
    assert subject.cameras == ()
    network.group("slice", "cut", id="inside")
    assert subject_of(network, "inside/cut").plane == "inside/slice.plane"
