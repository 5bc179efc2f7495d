"""A convolution with its ReLU and pooling in one kernel, for GPUs: the layers of PackageFeatures there.

torch writes the convolution's output, adds the bias, clips it and pools it in kernels of their own, each of which moves
it through the GPU's memory. These kernels keep it in registers: of every pooled pixel they write the value and the place of
the largest of its four pixels. They are Triton's, which comes with PyTorch for CUDA. Factors are rounded to TF32, as in
torch's own convolutions unless torch.backends.cudnn.allow_tf32 is False.
"""

# mypy: disable-error-code="no-untyped-def, untyped-decorator"
from __future__ import annotations

from typing import Any

import torch
import triton
import triton.language as tl
from torch.autograd.function import once_differentiable

DEAD = tl.constexpr(4)  # place of a pooled pixel that the ReLU has set to zero
PARTS = 528  # of the sums over a batch: four for each multiprocessor of an H100


@triton.jit
def _patches(base, rows, columns, row, column, inside, k, CHANNELS: tl.constexpr, WIDTH: tl.constexpr, PLANAR: tl.constexpr):
    """Inputs of one pixel of the convolution each, shape (pixels, WIDTH).

    PLANAR: the image is stored by channels; all taps at once, in the order of the weights. Else by pixels; the channels of
    tap k. Threads that are neighbours load what is near in memory.
    """
    index = tl.arange(0, WIDTH)
    if PLANAR:
        y, x = 2 * row[None, :] + (index % 9 // 3 - 1)[:, None], 2 * column[None, :] + (index % 3 - 1)[:, None]
        place = (index // 9)[:, None] * (rows * columns) + y * columns + x
        there = inside[None, :] & (index < 9 * CHANNELS)[:, None] & (y >= 0) & (y < rows) & (x >= 0) & (x < columns)
        return tl.trans(tl.load(base + place, mask=there, other=0.0))
    y, x = 2 * row[:, None] + (k // 3 - 1), 2 * column[:, None] + (k % 3 - 1)
    place = (y * columns + x) * CHANNELS + index[None, :]
    there = inside[:, None] & (index < CHANNELS)[None, :] & (y >= 0) & (y < rows) & (x >= 0) & (x < columns)
    return tl.load(base + place, mask=there, other=0.0)


@triton.jit
def _replaces(value, largest):
    """Whether a later pixel is the largest so far: of equal ones the first is, and of those without a value the last."""
    return (value > largest) | (value != value)  # noqa: PLR0124


@triton.jit
def _forward(images, weight, bias, out, places, rows, columns, pooled_rows, pooled_columns, CHANNELS: tl.constexpr,
             WIDTH: tl.constexpr, TAPS: tl.constexpr, OUT: tl.constexpr, PIXELS: tl.constexpr, PLANAR: tl.constexpr):
    image = tl.program_id(1).to(tl.int64)
    pixel, channel, index = tl.program_id(0) * PIXELS + tl.arange(0, PIXELS), tl.arange(0, OUT), tl.arange(0, WIDTH)
    inside = pixel < pooled_rows * pooled_columns
    row, column = 2 * (pixel // pooled_columns), 2 * (pixel % pooled_columns)
    base = images + image * CHANNELS * rows * columns
    a = tl.zeros((PIXELS, OUT), tl.float32)
    b = tl.zeros((PIXELS, OUT), tl.float32)
    c = tl.zeros((PIXELS, OUT), tl.float32)
    d = tl.zeros((PIXELS, OUT), tl.float32)
    for k in range(TAPS):
        w = tl.load(weight + (k * WIDTH + index)[:, None] * OUT + channel[None, :])
        a = tl.dot(_patches(base, rows, columns, row, column, inside, k, CHANNELS, WIDTH, PLANAR), w, a)
        b = tl.dot(_patches(base, rows, columns, row, column + 1, inside, k, CHANNELS, WIDTH, PLANAR), w, b)
        c = tl.dot(_patches(base, rows, columns, row + 1, column, inside, k, CHANNELS, WIDTH, PLANAR), w, c)
        d = tl.dot(_patches(base, rows, columns, row + 1, column + 1, inside, k, CHANNELS, WIDTH, PLANAR), w, d)
    place = tl.zeros((PIXELS, OUT), tl.int32)
    place = tl.where(_replaces(b, a), 1, place)
    a = tl.where(place == 1, b, a)
    place = tl.where(_replaces(c, a), 2, place)
    a = tl.where(place == 2, c, a)
    place = tl.where(_replaces(d, a), 3, place)
    a = tl.where(place == 3, d, a)
    a += tl.load(bias + channel)[None, :]
    place = tl.where(a <= 0, DEAD, place)
    a = tl.where(a <= 0, 0.0, a)
    at = (image * pooled_rows * pooled_columns + pixel)[:, None] * OUT + channel[None, :]
    tl.store(out + at, a, mask=inside[:, None])
    tl.store(places + at, place.to(tl.uint8), mask=inside[:, None])


@triton.jit
def _weight_gradient(images, gradient, places, parts, bias_parts, batch, rows, columns, pooled_rows, pooled_columns,
                     CHANNELS: tl.constexpr, WIDTH: tl.constexpr, TAPS: tl.constexpr, OUT: tl.constexpr, PIXELS: tl.constexpr,
                     PLANAR: tl.constexpr):
    part, k, of = tl.program_id(0), tl.program_id(1), tl.num_programs(0)
    channel, index = tl.arange(0, OUT), tl.arange(0, WIDTH)
    pooled = pooled_rows * pooled_columns
    blocks = tl.cdiv(pooled, PIXELS)
    total = tl.zeros((WIDTH, OUT), tl.float32)
    of_bias = tl.zeros((OUT,), tl.float32)
    for block in range(part, batch * blocks, of):
        image = (block // blocks).to(tl.int64)
        pixel = block % blocks * PIXELS + tl.arange(0, PIXELS)
        inside = pixel < pooled
        row, column = 2 * (pixel // pooled_columns), 2 * (pixel % pooled_columns)
        base = images + image * CHANNELS * rows * columns
        at = (image * pooled + pixel)[:, None] * OUT + channel[None, :]
        g = tl.load(gradient + at, mask=inside[:, None], other=0.0)
        place = tl.load(places + at, mask=inside[:, None], other=DEAD).to(tl.int32)
        of_bias += tl.sum(tl.where(place != DEAD, g, 0.0), 0)
        for q in tl.static_range(4):
            patches = _patches(base, rows, columns, row + q // 2, column + q % 2, inside, k, CHANNELS, WIDTH, PLANAR)
            total = tl.dot(tl.trans(patches), tl.where(place == q, g, 0.0), total)
    tl.store(parts + ((part * TAPS + k) * WIDTH + index)[:, None] * OUT + channel[None, :], total)
    if k == 0:
        tl.store(bias_parts + part * OUT + channel, of_bias)


@triton.jit
def _image_gradient(gradient, places, weight, out, rows, columns, pooled_rows, pooled_columns, CHANNELS: tl.constexpr,
                    OUT: tl.constexpr, PIXELS: tl.constexpr):
    """Pixels of which a program computes the gradient have rows and columns of the same parity: they use the same taps."""
    image, odd_row, odd_column = tl.program_id(1).to(tl.int64), tl.program_id(2) // 2, tl.program_id(2) % 2
    channel, deep = tl.arange(0, CHANNELS), tl.arange(0, OUT)
    some_rows, some_columns = (rows + 1 - odd_row) // 2, (columns + 1 - odd_column) // 2
    pixel = tl.program_id(0) * PIXELS + tl.arange(0, PIXELS)
    inside = pixel < some_rows * some_columns
    row, column = pixel // some_columns, pixel % some_columns
    total = tl.zeros((PIXELS, CHANNELS), tl.float32)
    for down in range(1 + odd_row):
        for right in range(1 + odd_column):
            # Tap 1 reaches an even pixel from the pixel of the convolution at half its place, taps 2 and 0 an odd one.
            tap_row, tap_column = 1 + odd_row - 2 * down, 1 + odd_column - 2 * right
            y, x = row + down, column + right
            at = (image * pooled_rows * pooled_columns + (y // 2) * pooled_columns + x // 2)[:, None] * OUT + deep[None, :]
            there = (inside & (y // 2 < pooled_rows) & (x // 2 < pooled_columns))[:, None]
            place = tl.load(places + at, mask=there, other=DEAD).to(tl.int32)
            g = tl.load(gradient + at, mask=there & (place == (y % 2 * 2 + x % 2)[:, None]), other=0.0)
            w = tl.load(weight + ((3 * tap_row + tap_column) * CHANNELS + channel)[None, :] * OUT + deep[:, None])
            total = tl.dot(g, w, total)
    at = (image * rows * columns + (2 * row + odd_row) * columns + 2 * column + odd_column)
    tl.store(out + at[:, None] * CHANNELS + channel[None, :], total, mask=inside[:, None])


def _power(value: int) -> int:
    """The next power of two, and at least what a product of matrices takes."""
    return max(16, triton.next_power_of_2(value))


class PooledConvolution(torch.autograd.Function):
    """relu(max_pool2d(conv2d(images, weight, bias, stride=2, padding=1), 2)) for 3 x 3 weights.

    Args of apply:
        images: Shape (batch, channels, rows, columns), stored by channels, or by pixels (torch.channels_last) with a power
            of two of channels, at least 16. Only those stored by pixels get a gradient.
        weight: Shape (out, channels, 3, 3), out a power of two, at least 16.
        bias: Shape (out,).

    Returns:
        Shape (batch, out, rows / 4, columns / 4), stored by pixels.
    """

    @staticmethod
    def forward(ctx: Any, images: torch.Tensor, weight: torch.Tensor, bias: torch.Tensor) -> torch.Tensor:
        """Called by apply."""
        batch, channels, rows, columns = images.shape
        planar = not images.is_contiguous(memory_format=torch.channels_last) or channels != _power(channels)
        if planar:
            images = images.contiguous()
        out = len(weight)
        width, taps = (_power(9 * channels), 1) if planar else (channels, 9)
        if planar:
            table = torch.zeros((width, out), device=weight.device)
            table[:9 * channels] = weight.detach().reshape(out, -1).T
        else:
            table = weight.detach().permute(2, 3, 1, 0).contiguous()
        pooled_rows, pooled_columns = (rows + 1) // 4, (columns + 1) // 4
        values = torch.empty((batch, pooled_rows, pooled_columns, out), device=images.device)
        places = torch.empty(values.shape, dtype=torch.uint8, device=images.device)
        pixels = 64 if out <= 32 else 32
        _forward[(triton.cdiv(pooled_rows * pooled_columns, pixels), batch)](
            images, table, bias.detach(), values, places, rows, columns, pooled_rows, pooled_columns, channels, width, taps,
            out, pixels, planar, num_warps=8, num_stages=2)
        ctx.save_for_backward(images, table, places)
        ctx.planar = planar
        return values.permute(0, 3, 1, 2)

    @staticmethod
    @once_differentiable  # type: ignore[untyped-decorator]
    def backward(ctx: Any, gradient: torch.Tensor) -> tuple[torch.Tensor | None, torch.Tensor, torch.Tensor]:
        """Called by torch."""
        images, table, places = ctx.saved_tensors
        batch, channels, rows, columns = images.shape
        pooled_rows, pooled_columns, out = places.shape[1:]
        gradient = gradient.permute(0, 2, 3, 1).contiguous()
        width, taps = (len(table), 1) if ctx.planar else (channels, 9)
        count = PARTS // taps
        parts = torch.empty((count, taps * width, out), device=images.device)
        bias_parts = torch.empty((count, out), device=images.device)
        _weight_gradient[(count, taps)](
            images, gradient, places, parts, bias_parts, batch, rows, columns, pooled_rows, pooled_columns, channels, width,
            taps, out, 32, ctx.planar, num_warps=8, num_stages=1)
        of_weight = parts.sum(0)
        if ctx.planar:
            of_weight = of_weight[:9 * channels].T.reshape(out, channels, 3, 3)
        else:
            of_weight = of_weight.reshape(3, 3, channels, out).permute(3, 2, 0, 1)
        of_images = None
        if ctx.needs_input_grad[0]:
            if ctx.planar:
                raise NotImplementedError("images that are stored by channels get no gradient")
            of_images = torch.empty((batch, rows, columns, channels), device=images.device)
            grid = (triton.cdiv((rows + 1) // 2 * ((columns + 1) // 2), 64), batch, 4)
            _image_gradient[grid](gradient, places, table, of_images, rows, columns, pooled_rows, pooled_columns, channels, out,
                                  64, num_warps=8, num_stages=1)
            of_images = of_images.permute(0, 3, 1, 2)
        return of_images, of_weight, bias_parts.sum(0)
