// PooledConvolution for Python.
#include <algorithm>
#include <optional>

#include "bindings.h"
#include "pooled_convolution.h"

namespace relign::python {
namespace {

using Shape = PooledConvolution::Shape;

std::size_t axis(const py::buffer& array, py::ssize_t index, const char* what) {
  const py::buffer_info info = array.request();
  if (info.ndim != 4) throw Error(ErrorKind::bad_input, std::string(what) + " must have four dimensions");
  return static_cast<std::size_t>(info.shape[static_cast<std::size_t>(index)]);
}

Shape shape_of(const py::buffer& images, const py::buffer& weights) {
  const Shape shape{axis(images, 0, "images"), axis(images, 1, "images"), axis(images, 2, "images"),
                    axis(images, 3, "images"), axis(weights, 0, "weights")};
  if (shape.channels == 0 || shape.out_height() == 0 || shape.out_width() == 0)
    throw Error(ErrorKind::bad_input, "images must have a channel and at least 3 x 3 pixels");
  if (shape.out_channels % PooledConvolution::kBlock != 0)
    throw Error(ErrorKind::bad_input, "the number of output channels must be a multiple of " +
                                          std::to_string(PooledConvolution::kBlock) + ", not " +
                                          std::to_string(shape.out_channels));
  return shape;
}

const float* images_of(const py::buffer& images, const Shape& shape) {
  return numbers_of<float>(images, {shape.images, shape.channels, shape.height, shape.width}, false, "images");
}

const float* weights_of(const py::buffer& weights, const Shape& shape) {
  return numbers_of<float>(weights, {shape.out_channels, shape.channels, 3, 3}, false, "weights");
}

void forward(PooledConvolution& layer, const py::buffer& images, const py::buffer& weights, const py::buffer& bias,
             const py::buffer& out, const py::buffer& places) {
  const Shape shape = shape_of(images, weights);
  const std::vector<std::size_t> outputs = {shape.images, shape.out_channels, shape.out_height(), shape.out_width()};
  const float* from = images_of(images, shape);
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
  const std::vector<std::size_t> outputs = {shape.images, shape.out_channels, shape.out_height(), shape.out_width()};
  const float* from = images_of(images, shape);
  const float* by = weights_of(weights, shape);
  const float* of_out = numbers_of<float>(gradient, outputs, false, "gradient");
  const auto* which = numbers_of<std::uint8_t>(places, outputs, false, "places");
  float* to_images = nullptr;
  if (of_images)
    to_images =
        numbers_of<float>(*of_images, {shape.images, shape.channels, shape.height, shape.width}, true, "of_images");
  auto* to_weights = numbers_of<float>(of_weights, {shape.out_channels, shape.channels, 3, 3}, true, "of_weights");
  auto* to_bias = numbers_of<float>(of_bias, {shape.out_channels}, true, "of_bias");
  const py::gil_scoped_release others;
  layer.backward(shape, from, by, of_out, which, to_images, to_weights, to_bias);
}

}  // namespace

void bind_convolution(py::module_& module) {
  using py::arg;
  py::class_<PooledConvolution>(module, "PooledConvolution", "A convolution, pooling by the maximum, and ReLU.")
      .def(py::init([](unsigned threads) { return std::make_unique<PooledConvolution>(std::max(1U, threads)); }),
           arg("threads"))
      .def_readonly_static("BLOCK", &PooledConvolution::kBlock)
      .def("forward", &forward, arg("images"), arg("weights"), arg("bias"), arg("out"), arg("places"))
      .def("backward", &backward, arg("images"), arg("weights"), arg("gradient"), arg("places"), arg("of_images"),
           arg("of_weights"), arg("of_bias"));
}

}  // namespace relign::python
