# SPDX-License-Identifier: GPL-2.0-or-later
"""Arrays of batches on a CUDA device, as tensors of PyTorch in the same memory. Skipped without PyTorch and CUDA."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import stagesim as st

torch = pytest.importorskip("torch")
if not torch.cuda.is_available():
    pytest.skip("there is no CUDA device", allow_module_level=True)

WORLD = """
resolution 0.02
contacts "cells"
model( pose [0 1.3 0 0] size [2.6 0.1 1] )
model( pose [0 -1.3 0 10] size [2.6 0.1 1] )
define bot position( size [0.2 0.2 0.3] ranger( pose [0 0 -0.1 0] sensor( range [0 1] fov 270 samples 12 ) ) )
bot( pose [-0.5 -0.5 0 30] )
bot( pose [0.5 0.5 0 -100] )
bot( pose [0.5 -0.5 0 60] )
"""


@pytest.fixture
def batches(tmp_path: Path) -> tuple[st.Batch, st.Batch]:
    """Returns 500 equal worlds on the host and on the card."""
    file = tmp_path / "w.world"
    file.write_text(WORLD)
    return st.Batch(file, 500), st.Batch(file, 500, device="opencl:gpu")


def test_tensors_are_in_the_memory_of_the_batch(batches: tuple[st.Batch, st.Batch]) -> None:
    host, card = batches
    pose, ranges, stalled, cmd = (torch.from_dlpack(array) for array in (card.pose, card.ranges, card.stalled, card.cmd))
    assert pose.is_cuda and pose.shape == (500, 3, 3) and stalled.dtype == torch.bool
    host_ranges = host.ranges
    random = np.random.default_rng(1)
    for _ in range(100):
        commands = random.uniform(-1, 1, host.cmd.shape)
        host.cmd[...] = commands
        cmd.copy_(torch.as_tensor(commands))
        host.step()
        card.step()
        assert np.array_equal(pose.cpu().numpy(), host.pose)
        assert np.array_equal(ranges.cpu().numpy(), host_ranges)
        assert np.array_equal(stalled.cpu().numpy(), host.stalled)
    assert host.stalled.any() and host.state_hashes() == card.state_hashes()


def test_commands_that_are_still_being_calculated_are_waited_for(batches: tuple[st.Batch, st.Batch]) -> None:
    host, card = batches
    cmd, pose = torch.from_dlpack(card.cmd), torch.from_dlpack(card.pose)
    stream = torch.cuda.Stream()
    for speed in (0.1, -0.2, 0.3):
        with torch.cuda.stream(stream):
            torch.cuda._sleep(100_000_000)  # some 50 ms
            cmd.fill_(speed)
        card.step()
        host.cmd[...] = speed
        host.step()
        assert np.array_equal(pose.cpu().numpy(), host.pose)


def test_readers_that_are_under_way_see_the_array_from_before(batches: tuple[st.Batch, st.Batch]) -> None:
    card = batches[1]
    cmd, pose = torch.from_dlpack(card.cmd), torch.from_dlpack(card.pose)
    cmd.fill_(0.5)
    before = pose.cpu()
    stream = torch.cuda.Stream()
    with torch.cuda.stream(stream):
        torch.cuda._sleep(100_000_000)
        copied = pose.clone()
    card.step(3)
    torch.cuda.synchronize()
    assert torch.equal(copied.cpu(), before) and not torch.equal(pose.cpu(), before)


def test_calls_that_do_not_wait_are_in_the_order_of_the_default_stream(batches: tuple[st.Batch, st.Batch]) -> None:
    host, card = batches
    cmd, pose = torch.from_dlpack(card.cmd), torch.from_dlpack(card.pose)
    try:
        card.synchronous = False
    except st.StageError as error:  # OpenCL makes the steps, see STAGE_CL_CUDA
        pytest.skip(str(error))
    records = []
    for speed in np.linspace(-0.5, 0.5, 30):
        torch.cuda._sleep(1_000_000)
        cmd.fill_(speed)
        card.step()
        records.append(pose.clone())
    for speed, record in zip(np.linspace(-0.5, 0.5, 30), records):
        host.cmd[...] = speed
        host.step()
        assert np.array_equal(record.cpu().numpy(), host.pose)


def test_masks_and_poses_on_the_card_equal_those_on_the_host(batches: tuple[st.Batch, st.Batch]) -> None:
    host, card = batches
    random = np.random.default_rng(2)
    host_ranges, ranges = host.ranges, card.ranges
    for _ in range(40):
        mask = random.random(host.n) < 0.2
        host.reset(ids=mask)
        card.reset(ids=torch.as_tensor(mask, device="cuda"))
        poses, some = random.uniform(-1, 1, (host.n, 3, 3)), random.random((host.n, 3)) < 0.3
        host.teleport(poses, some)
        card.teleport(torch.as_tensor(poses, device="cuda"), torch.as_tensor(some, device="cuda"))
        host.cmd[...] = card.cmd[...] = random.uniform(-1, 1, host.cmd.shape)
        host.step()
        card.step()
        assert np.array_equal(np.asarray(ranges), host_ranges)
        assert host.state_hashes() == card.state_hashes()
    card.reset(ids=torch.ones(host.n, dtype=torch.bool, device="cuda"))
    assert not np.asarray(card.cmd).any()


def test_tensors_of_another_shape_are_refused(batches: tuple[st.Batch, st.Batch]) -> None:
    card = batches[1]
    with pytest.raises(ValueError, match="found a mask of the type bool and the shape \\(3,\\), expected"):
        card.reset(ids=torch.ones(3, dtype=torch.bool, device="cuda"))
    with pytest.raises(ValueError, match="found poses of the type float32"):
        card.teleport(torch.zeros((500, 3, 3), device="cuda"), torch.ones((500, 3), dtype=torch.bool, device="cuda"))


def test_tensors_outlive_the_batch(tmp_path: Path) -> None:
    file = tmp_path / "w.world"
    file.write_text(WORLD)
    card = st.Batch(file, 4, device="opencl:gpu")
    pose = torch.from_dlpack(card.pose)
    expected = np.asarray(card.pose)
    del card
    assert np.array_equal((pose + 0).cpu().numpy(), expected)


def test_cupy_and_jax_share_the_memory(batches: tuple[st.Batch, st.Batch]) -> None:
    card = batches[1]
    cupy = pytest.importorskip("cupy")
    pose, cmd = cupy.from_dlpack(card.pose), torch.from_dlpack(card.cmd)
    cmd.fill_(0.5)
    card.step(5)
    assert np.array_equal(cupy.asnumpy(pose), np.asarray(card.pose))
    jax = pytest.importorskip("jax")
    jax.config.update("jax_enable_x64", True)
    assert np.array_equal(np.asarray(jax.dlpack.from_dlpack(card.pose)), np.asarray(card.pose))
