"""The closed table of log channels: which schema each topic has."""

from __future__ import annotations

from kendama_cli.schema.messages import LogSchemaError

FRAME = "foxglove.FrameTransform"
JOINTS = "foxglove.JointStates"
IMAGE = "foxglove.CompressedImage"
WRENCH = "kendama.Wrench"

CHANNELS: dict[str, str] = {
    "/capture/cup": FRAME,
    "/encode/demonstrated": FRAME,
    "/encode/own": FRAME,
    "/encode/reproduced": FRAME,
    "/encode/weights": "kendama.Weights",
    "/adapt/rollout": "kendama.AdaptRollout",
    "/adapt/corner": "kendama.AdaptRollout",
    "/adapt/window": "kendama.AdaptWindow",
    "/adapt/repeat": "kendama.AdaptRepeat",
    "/adapt/joints": JOINTS,
    "/adapt/cup": FRAME,
    "/adapt/ball": FRAME,
    "/adapt/reference": FRAME,
    "/learn/rollout": "kendama.Rollout",
    "/learn/table": "kendama.QTable",
    "/learn/step": "kendama.SwingState",
    "/learn/cup": FRAME,
    "/learn/ball": FRAME,
    "/predict/detection": "kendama.Detection",
    "/predict/estimate": "kendama.CatchEstimate",
    "/predict/error": "kendama.PredictionError",
    "/predict/ball": FRAME,
    "/transfer/step": "kendama.TransferStep",
    "/transfer/rollout": "kendama.Rollout",
    "/transfer/scratch/rollout": "kendama.Rollout",
    "/transfer/joints": JOINTS,
    "/transfer/cup": FRAME,
    "/transfer/ball": FRAME,
    "/transfer/detection": "kendama.Detection",
    "/transfer/estimate": "kendama.GameEstimate",
    "/transfer/game": "kendama.Game",
    "/transfer/imitation/cup": FRAME,
    "/transfer/imitation/ball": FRAME,
    "/transfer/imitation/wrench": WRENCH,
    "/transfer/wrench": WRENCH,
    "/interact/joints": JOINTS,
    "/interact/tool": FRAME,
    "/interact/reference": FRAME,
    "/interact/body": FRAME,
    "/interact/wrench": WRENCH,
    "/interact/contact": "kendama.Contact",
    "/identify/joints": JOINTS,
    "/identify/wrench": WRENCH,
    "/identify/friction": "kendama.JointFriction",
    "/identify/tracking/reference": FRAME,
    "/identify/tracking/before": FRAME,
    "/identify/tracking/after": FRAME,
}
"""Topic -> schema."""

FAMILIES: dict[str, str] = {
    "/predict/image/": IMAGE,
    "/transfer/image/": IMAGE,
}
"""Topic prefix -> schema of all topics one level below it (one per camera)."""


def schema_of(topic: str) -> str:
    """The schema of ``topic``; LogSchemaError, naming it, where the tables do not have it."""
    if topic in CHANNELS:
        return CHANNELS[topic]
    for prefix, schema in FAMILIES.items():
        name = topic.removeprefix(prefix)
        if name != topic and name and "/" not in name:
            return schema
    known = ", ".join([*CHANNELS, *(f"{prefix}<name>" for prefix in FAMILIES)])
    raise LogSchemaError(f"unknown log topic '{topic}'; kendama_cli/log/channels.py has {known}")
