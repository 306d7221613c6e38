"""Call a processor's function directly on a device, without a network: laws of the function, not of the engine."""

from __future__ import annotations

from typing import Any

from nodegraph import registry


class MadeAnew:
    """The service `memo` where nothing is kept."""

    def __call__(self, function: Any, *args: Any, disk: bool = False) -> Any:
        return function(*args)

    def kept(self, function: Any, *args: Any) -> bool:
        return False


def call(
    id: str,
    device: Any = None,
    size: tuple[int, int] | None = None,
    *,
    quality: str = "final",
    memo: Any = None,
    explain: Any = None,
    **values: Any,
) -> Any:
    """Run ``process`` with the declared defaults for what is not given; ``wanted`` is everything."""
    cls = registry.find(id)
    arguments = dict.fromkeys(cls.inputs)
    arguments |= {name: param.default for name, param in cls.params.items()}
    unknown = set(values) - set(arguments)
    assert not unknown, f"{id} declares no {unknown}"
    arguments |= values
    services = {"size": size, "device": device, "wanted": frozenset(cls.outputs), "quality": quality}
    services["progress"] = lambda fraction, text="": None
    services["memo"] = memo or MadeAnew()
    services["workspace"] = lambda path: ""
    services["explain"] = explain or (lambda text: None)
    arguments |= {name: value for name, value in services.items() if name in cls.services}
    return cls().process(**arguments)
