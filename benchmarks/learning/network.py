"""A small convolutional network: one encoder for every drive, what the others show beside it, one softmax."""

from __future__ import annotations

import copy
import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import torch
from torch import Tensor, nn

from benchmarks.learning.drawn import Drawn
from benchmarks.learning.labels import OF_A_DRIVE, WHOLE_ARM
from benchmarks.learning.rows import CONTEXT
from robots.arrays import FloatArray

WIDTH, INPUTS, BATCH, RATE, DECAY, DROPOUT, PATIENCE = 48, 12, 32, 2e-3, 1e-3, 0.2, 4
"""Usual figures; none was searched for."""


class Net(nn.Module):
    """Scores of all answers, B × (1 + arm's + n × drive's), of windows B × rows × n × channels."""

    def __init__(self) -> None:
        super().__init__()
        sizes = (INPUTS, 32, WIDTH, WIDTH, 2 * WIDTH)
        layers: list[nn.Module] = []
        for k, (few, many) in enumerate(pairwise(sizes)):
            wide = 7 if k == 0 else 5
            layers += [
                nn.Conv1d(few, many, wide, stride=2, padding=wide // 2),
                nn.BatchNorm1d(many),
                nn.ReLU(),
            ]
        self.encoder = nn.Sequential(*layers)
        size = 4 * WIDTH + len(CONTEXT) + 3
        self.mix = nn.Sequential(nn.Linear(size, 96), nn.ReLU(), nn.Dropout(DROPOUT))
        self.drive = nn.Sequential(nn.Linear(5 * 96, 128), nn.ReLU(), nn.Linear(128, len(OF_A_DRIVE)))
        self.arm = nn.Sequential(nn.Linear(2 * 96, 64), nn.ReLU(), nn.Linear(64, 1 + len(WHOLE_ARM)))

    def forward(self, window: Tensor, context: Tensor) -> Tensor:
        batch, rows, drives, _ = window.shape
        shown, loud = inputs_of(window)
        coded = self.encoder(shown.permute(0, 2, 3, 1).reshape(batch * drives, INPUTS, rows))
        both = torch.cat([coded.mean(dim=2), coded.amax(dim=2)], dim=1).reshape(batch, drives, -1)
        h = self.mix(torch.cat([both, context / 3.0, loud], dim=2))
        mean, most = h.mean(dim=1), h.amax(dim=1)
        none = torch.zeros_like(h[:, :1])
        before, after = torch.cat([none, h[:, :-1]], dim=1), torch.cat([h[:, 1:], none], dim=1)
        arm = torch.cat([mean, most], dim=1)
        beside = torch.cat([h, before, after, arm.unsqueeze(1).expand(-1, drives, -1)], dim=2)
        return torch.cat([self.arm(arm), self.drive(beside).flatten(1)], dim=1)


def inputs_of(window: Tensor) -> tuple[Tensor, Tensor]:
    """What the encoder sees, B × rows × n × inputs, and how loud each drive is, B × n × 3."""
    q, v, a, torque, load, left, still, fast = window.unbind(dim=3)
    level = window[..., 5:].square().mean(dim=1).sqrt()
    shape = left / (level[:, None, :, 0] + 0.3)
    shown = [q - q.mean(dim=1, keepdim=True), q.sin(), q.cos(), v, (v * 50.0).tanh(), a, 3 * torque, 3 * load]
    return torch.stack([*shown, shape, left.asinh(), still.asinh(), fast.log1p()], dim=3), level.log1p()


@dataclass(frozen=True)
class Network:
    """A learned net."""

    net: Net

    def scores(self, windows: FloatArray, context: FloatArray) -> FloatArray:
        """Logarithms of probabilities, windows × answers."""
        self.net.eval()
        with torch.no_grad():
            inputs = torch.as_tensor(np.asarray(windows, dtype=np.float32))
            known = torch.as_tensor(np.asarray(context, dtype=np.float32)).expand(len(inputs), -1, -1)
            return np.asarray(self.net(inputs, known).log_softmax(dim=1).numpy())


def learn(
    drawn: Drawn, seconds: float, seed: int = 0, told: Callable[[str], None] = lambda line: None
) -> Network:
    """Learn until the held-out worlds' loss falls no more, or the time is over."""
    torch.manual_seed(seed)
    torch.set_num_threads(1)
    rng, until = np.random.default_rng(seed), time.monotonic() + seconds
    fit, held = drawn.part(False), drawn.part(True)
    net = Net()
    optimiser = torch.optim.AdamW(net.parameters(), lr=RATE, weight_decay=DECAY)
    slower = torch.optim.lr_scheduler.ReduceLROnPlateau(optimiser, factor=0.4, patience=1)
    best, state, since = np.inf, copy.deepcopy(net.state_dict()), 0
    for epoch in range(100):
        learned = _epoch(net, optimiser, fit, rng, until)
        loss, right = _held_out(net, held)
        told(f"epoch {epoch}: {learned:.3f} learned, {loss:.3f} held out, {right:.1%} right")
        slower.step(loss)
        best, state, since = (
            (loss, copy.deepcopy(net.state_dict()), 0) if loss < best else (best, state, since + 1)
        )
        if since > PATIENCE or time.monotonic() > until:
            break
    net.load_state_dict(state)
    return Network(net)


def _epoch(
    net: Net, optimiser: torch.optim.Optimizer, fit: Drawn, rng: np.random.Generator, until: float
) -> float:
    net.train()
    order, total, steps = rng.permutation(len(fit.answer)), 0.0, 0
    for start in range(0, len(order) - 1, BATCH):
        if time.monotonic() > until:
            break
        some = np.sort(order[start : start + BATCH])
        window = torch.as_tensor(fit.window[some].astype(np.float32))
        context, answer = torch.as_tensor(fit.context[some]), torch.as_tensor(fit.answer[some])
        loss = nn.functional.cross_entropy(
            net(other_conventions(window), context), answer, label_smoothing=0.02
        )
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        total, steps = total + float(loss.detach()), steps + 1
    return total / max(steps, 1)


def other_conventions(window: Tensor) -> Tensor:
    """Drives that count the other way and from another zero, each by chance: what is hidden stays."""
    batch, _, drives, channels = window.shape
    sign = torch.ones(batch, 1, drives, channels)
    sign[..., :-1] = torch.randint(0, 2, (batch, 1, drives, 1)) * 2.0 - 1.0
    found = window * sign
    found[..., 0] += (torch.rand(batch, 1, drives) * 2.0 - 1.0) * np.pi
    return found


def _held_out(net: Net, held: Drawn) -> tuple[float, float]:
    net.eval()
    loss, right = 0.0, 0
    with torch.no_grad():
        for start in range(0, len(held.answer), 128):
            part = slice(start, start + 128)
            scores = net(
                torch.as_tensor(held.window[part].astype(np.float32)), torch.as_tensor(held.context[part])
            )
            answer = torch.as_tensor(held.answer[part])
            loss += float(nn.functional.cross_entropy(scores, answer, reduction="sum"))
            right += int((scores.argmax(dim=1) == answer).sum())
    return loss / max(len(held.answer), 1), right / max(len(held.answer), 1)
