#include <tiffio.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>

#include "base/error.h"
#include "images/decoding.h"

namespace relign::images {
namespace {

// A file in memory, for TIFFClientOpen.
struct Memory {
  std::string bytes;
  std::size_t at = 0;
};

Memory& memory(thandle_t handle) { return *static_cast<Memory*>(handle); }

tmsize_t read_some(thandle_t handle, void* out, tmsize_t wanted) {
  Memory& file = memory(handle);
  const std::size_t count =
      std::min(static_cast<std::size_t>(wanted), file.bytes.size() - std::min(file.at, file.bytes.size()));
  std::memcpy(out, file.bytes.data() + file.at, count);
  file.at += count;
  return static_cast<tmsize_t>(count);
}

tmsize_t write_some(thandle_t handle, void* data, tmsize_t count) {
  Memory& file = memory(handle);
  const auto size = static_cast<std::size_t>(count);
  if (file.at + size > file.bytes.size()) file.bytes.resize(file.at + size);
  std::memcpy(file.bytes.data() + file.at, data, size);
  file.at += size;
  return count;
}

toff_t seek(thandle_t handle, toff_t offset, int from) {
  Memory& file = memory(handle);
  if (from == SEEK_CUR) offset += file.at;
  if (from == SEEK_END) offset += file.bytes.size();
  return file.at = static_cast<std::size_t>(offset);
}

int close_nothing(thandle_t) { return 0; }
toff_t size_of(thandle_t handle) { return memory(handle).bytes.size(); }

using Tiff = std::unique_ptr<TIFF, void (*)(TIFF*)>;

Tiff open_tiff(Memory& file, const char* mode) {
  TIFFSetErrorHandler(nullptr);  // the caller reports the error with the file's name
  TIFFSetWarningHandler(nullptr);
  return {TIFFClientOpen("image", mode, &file, read_some, write_some, seek, close_nothing, size_of, nullptr, nullptr),
          TIFFClose};
}

float sample(const std::uint8_t* row, std::size_t index, int bits) {
  if (bits == 8) return static_cast<float>(row[index]) / 255.0F;
  if (bits == 16) {
    std::uint16_t value = 0;
    std::memcpy(&value, row + 2 * index, 2);
    return static_cast<float>(value) / 65535.0F;
  }
  float value = 0;
  std::memcpy(&value, row + 4 * index, 4);
  return value;
}

}  // namespace

std::string encode_tiff(std::size_t width, std::size_t height, const float* values) {
  Memory file;
  {
    const Tiff tiff = open_tiff(file, "w");
    if (!tiff) throw Error(ErrorKind::internal, "libtiff cannot write the image");
    TIFFSetField(tiff.get(), TIFFTAG_IMAGEWIDTH, static_cast<std::uint32_t>(width));
    TIFFSetField(tiff.get(), TIFFTAG_IMAGELENGTH, static_cast<std::uint32_t>(height));
    TIFFSetField(tiff.get(), TIFFTAG_BITSPERSAMPLE, 32);
    TIFFSetField(tiff.get(), TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_IEEEFP);
    TIFFSetField(tiff.get(), TIFFTAG_SAMPLESPERPIXEL, 1);
    TIFFSetField(tiff.get(), TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    TIFFSetField(tiff.get(), TIFFTAG_COMPRESSION, COMPRESSION_NONE);
    TIFFSetField(tiff.get(), TIFFTAG_ROWSPERSTRIP, static_cast<std::uint32_t>(height));
    for (std::size_t row = 0; row < height; ++row)
      if (TIFFWriteScanline(tiff.get(), const_cast<float*>(values + row * width), static_cast<std::uint32_t>(row), 0) <
          0)
        throw Error(ErrorKind::internal, "libtiff cannot write the image");
  }
  return file.bytes;
}

GreyPixels decode_tiff(std::string_view bytes, std::size_t most_pixels) {
  Memory file{std::string(bytes)};
  const Tiff tiff = open_tiff(file, "r");
  if (!tiff) damaged("its header is damaged");
  std::uint32_t width = 0, height = 0;
  std::uint16_t bits = 1, channels = 1, layout = PLANARCONFIG_CONTIG, format = SAMPLEFORMAT_UINT,
                meaning = PHOTOMETRIC_MINISBLACK, compression = COMPRESSION_NONE;
  TIFFGetField(tiff.get(), TIFFTAG_IMAGEWIDTH, &width);
  TIFFGetField(tiff.get(), TIFFTAG_IMAGELENGTH, &height);
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_BITSPERSAMPLE, &bits);
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_SAMPLESPERPIXEL, &channels);
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_PLANARCONFIG, &layout);
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_SAMPLEFORMAT, &format);
  TIFFGetField(tiff.get(), TIFFTAG_PHOTOMETRIC, &meaning);
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_COMPRESSION, &compression);
  if (compression == COMPRESSION_JBIG)  // the wheel lacks it: no_jbig.c
    damaged("its compression, JBIG, is not supported; save it without compression or with LZW, in 8 or 16 bits");
  refuse_large(width, height, most_pixels);
  const bool whole = format == SAMPLEFORMAT_UINT && (bits == 8 || bits == 16),
             real = format == SAMPLEFORMAT_IEEEFP && bits == 32;
  const bool grey = meaning == PHOTOMETRIC_MINISBLACK || meaning == PHOTOMETRIC_MINISWHITE,
             colour = meaning == PHOTOMETRIC_RGB;
  if ((!whole && !real) || layout != PLANARCONFIG_CONTIG || TIFFIsTiled(tiff.get()) ||
      !(grey || (colour && channels >= 3)))
    damaged(
        "this kind of TIFF is not supported; allowed: strips, interleaved, grey or RGB, 8 or 16 bits or 32-bit floats");
  std::vector<std::uint8_t> row(static_cast<std::size_t>(TIFFScanlineSize(tiff.get())));
  if (row.size() < std::size_t{width} * channels * bits / 8) damaged("its rows are too short");
  GreyPixels out{width, height, std::vector<float>(std::size_t{width} * height)};
  for (std::uint32_t y = 0; y < height; ++y) {
    if (TIFFReadScanline(tiff.get(), row.data(), y, 0) < 0) damaged("its data are damaged");
    for (std::size_t x = 0; x < width; ++x) {
      const std::size_t at = x * channels;
      float value = sample(row.data(), at, bits);
      if (colour) value = luma(value, sample(row.data(), at + 1, bits), sample(row.data(), at + 2, bits));
      if (meaning == PHOTOMETRIC_MINISWHITE) value = 1 - value;
      out.values[std::size_t{y} * width + x] = value;
    }
  }
  return out;
}

}  // namespace relign::images
