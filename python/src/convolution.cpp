// PooledConvolution for Python.
#include <algorithm>
#include <optional>

#include "bindings.h"
#include "pooled_convolution.h"

namespace relign::python {
namespace {

using Shape = PooledConvolution::Shape;

std::size_t axis(const py::buffer_info& array, std::size_t index, const char* what) {
  if (array.ndim != 4) throw Error(ErrorKind::bad_input, std::string(what) + " must have four dimensions");
  return static_cast<std::size_t>(array.shape[index]);
}

Shape shape_of(const py::buffer& images, const py::buffer& weights) {
  const py::buffer_info given = images.request();
  const Shape shape{axis(given, 0, "images"), axis(given, 1, "images"), axis(given, 2, "images"),
                    axis(given, 3, "images"), axis(weights.request(), 0, "weights")};
  if (shape.channels == 0 || shape.out_height() == 0 || shape.out_width() == 0)
    throw Error(ErrorKind::bad_input, "images must have a channel and at least 3 x 3 pixels");
  if (shape.out_channels % PooledConvolution::kBlock != 0)
    throw Error(ErrorKind::bad_input, "the number of output channels must be a multiple of " +
                                          std::to_string(PooledConvolution::kBlock) + ", not " +
                                          std::to_string(shape.out_channels));
  return shape;
}

PooledConvolution::Images images_of(const py::buffer& images) {
  const py::buffer_info given = images.request();
  std::size_t strides[4];
  for (std::size_t k = 0; k < 4; ++k) {
    if (given.strides[k] < 0 || given.strides[k] % py::ssize_t{sizeof(float)} != 0)
      throw Error(ErrorKind::bad_input, "images must have strides of whole numbers, not negative");
    strides[k] = static_cast<std::size_t>(given.strides[k]) / sizeof(float);
  }
  if (given.format != py::format_descriptor<float>::format())
    throw Error(ErrorKind::bad_input, "images must be numbers of type 'f'");
  return {static_cast<const float*>(given.ptr), strides[0], strides[1], strides[2], strides[3]};
}

std::vector<std::size_t> outputs_of(const Shape& shape) {
  return {shape.images, shape.out_height(), shape.out_width(), shape.out_channels};
}

const float* weights_of(const py::buffer& weights, const Shape& shape) {
  return numbers_of<float>(weights, {shape.out_channels, shape.channels, 3, 3}, false, "weights");
}

void forward(PooledConvolution& layer, const py::buffer& images, const py::buffer& weights, const py::buffer& bias,
             const py::buffer& out, const py::buffer& places) {
  const Shape shape = shape_of(images, weights);
  const std::vector<std::size_t> outputs = outputs_of(shape);
  const PooledConvolution::Images from = images_of(images);
  const float* by = weights_of(weights, shape);
  const float* plus = numbers_of<float>(bias, {shape.out_channels}, false, "bias");
  auto* to = numbers_of<float>(out, outputs, true, "out");
  auto* which = numbers_of<std::uint8_t>(places, outputs, true, "places");
  const py::gil_scoped_release others;
  layer.forward(shape, from, by, plus, to, which);
}

void backward(PooledConvolution& layer, const py::buffer& images, const py::buffer& weights, const py::buffer& gradient,
              const py::buffer& places, const std::optional<py::buffer>& of_images, const py::buffer& of_weights,
              const py::buffer& of_bias) {
  const Shape shape = shape_of(images, weights);
  const std::vector<std::size_t> outputs = outputs_of(shape);
  const PooledConvolution::Images from = images_of(images);
  const float* by = weights_of(weights, shape);
  const float* of_out = numbers_of<float>(gradient, outputs, false, "gradient");
  const auto* which = numbers_of<std::uint8_t>(places, outputs, false, "places");
  if (std::any_of(which, which + shape.images * outputs[1] * outputs[2] * outputs[3],
                  [](std::uint8_t place) { return place > PooledConvolution::kNone; }))
    throw Error(ErrorKind::bad_input, "places must be those of forward(), 0 to 4");
  float* to_images = nullptr;
  if (of_images)
    to_images =
        numbers_of<float>(*of_images, {shape.images, shape.height, shape.width, shape.channels}, true, "of_images");
  auto* to_weights = numbers_of<float>(of_weights, {shape.out_channels, shape.channels, 3, 3}, true, "of_weights");
  auto* to_bias = numbers_of<float>(of_bias, {shape.out_channels}, true, "of_bias");
  const py::gil_scoped_release others;
  layer.backward(shape, from, by, of_out, which, to_images, to_weights, to_bias);
}

}  // namespace

void bind_convolution(py::module_& module) {
  using py::arg;
  py::class_<PooledConvolution>(module, "PooledConvolution",
                                "A convolution, pooling by the maximum, and ReLU; channels are last.")
      .def(py::init([](unsigned threads) { return std::make_unique<PooledConvolution>(std::max(1U, threads)); }),
           arg("threads"))
      .def_readonly_static("BLOCK", &PooledConvolution::kBlock)
      .def("forward", &forward, arg("images"), arg("weights"), arg("bias"), arg("out"), arg("places"))
      .def("backward", &backward, arg("images"), arg("weights"), arg("gradient"), arg("places"), arg("of_images"),
           arg("of_weights"), arg("of_bias"));
}

}  // namespace relign::python
