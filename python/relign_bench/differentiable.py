"""Images through which PyTorch's gradients flow to the poses of the lens (docs/derivatives.md has an example)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import torch

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ._typing import Slots
    from .batch import Batch


class _Render(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, poses: torch.Tensor, batch: Batch, slots: Slots, seeds: Sequence[int], samples: int) -> Any:
        images, slopes = batch.derivatives_at(slots, poses.detach().cpu().double().numpy(), seeds, samples)
        ctx.type = poses.dtype
        ctx.save_for_backward(torch.from_numpy(slopes).to(poses.device))
        return torch.from_numpy(images).to(poses.device)

    @staticmethod
    def backward(ctx: Any, *gradients: torch.Tensor) -> Any:
        (slopes,), (gradient,) = ctx.saved_tensors, gradients
        by_pose = torch.einsum("nhw,nahw->na", gradient.to(slopes.dtype), slopes)
        return by_pose.to(ctx.type), None, None, None, None


def render(batch: Batch, slots: Slots, poses: torch.Tensor, seeds: Sequence[int], samples: int = 64) -> torch.Tensor:
    """Images at true poses, as `Batch.derivatives_at`, with gradients by the poses.

    Image and derivatives come from the same rays, so the noise of a squared error and that of its gradient are correlated:
    average over seeds, or increase `samples`, where their product matters. Second derivatives are not available.

    Args:
        batch: The instances.
        slots: The slots, n of them.
        poses: True poses in [0, 1], shape (n, axes), of a floating-point type.
        seeds: Seeds of the rays, n of them.
        samples: Rays per pixel.

    Returns:
        Images in the scene's units, float32, shape (n, height, width), on the device of `poses`.

    Raises:
        ValueError: The scene has no derivatives, or an argument is not valid.
    """
    images: torch.Tensor = _Render.apply(poses, batch, slots, seeds, samples)  # type: ignore[no-untyped-call]
    return images
