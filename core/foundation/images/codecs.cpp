#include "images/codecs.h"

#include <jpeglib.h>  // needs <cstdio> before it
#include <png.h>
#include <webp/decode.h>
#include <webp/encode.h>

#include <algorithm>
#include <cmath>
#include <csetjmp>
#include <cstdio>
#include <cstring>

#include "base/error.h"
#include "images/decoding.h"

namespace relign::images {
namespace {

// ---- PNG -----------------------------------------------------------------------------------------

struct PngSource {
  std::string_view bytes;
  std::size_t at = 0;
};

[[noreturn]] void png_failed(png_structp png, png_const_charp message) {
  *static_cast<std::string*>(png_get_error_ptr(png)) = message;
  std::longjmp(png_jmpbuf(png), 1);
}

void png_warned(png_structp, png_const_charp) {}

void png_read(png_structp png, png_bytep out, std::size_t count) {
  auto& source = *static_cast<PngSource*>(png_get_io_ptr(png));
  if (count > source.bytes.size() - source.at) png_error(png, "it ends too early");
  std::memcpy(out, source.bytes.data() + source.at, count);
  source.at += count;
}

void png_append(png_structp png, png_bytep data, std::size_t count) {
  static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<const char*>(data), count);
}

void png_flush_nothing(png_structp) {}

// Rows of `decoded` as libpng fills them. Everything with a destructor belongs to the caller, because libpng leaves by
// longjmp.
bool read_png_rows(png_structp png, png_infop info, PngSource& source, std::size_t most,
                   std::vector<std::uint8_t>& decoded, std::vector<png_bytep>& rows, bool& sixteen, bool& colour,
                   bool& too_large) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_set_read_fn(png, &source, png_read);
  png_read_info(png, info);
  const std::size_t width = png_get_image_width(png, info), height = png_get_image_height(png, info);
  too_large = is_too_large(width, height, most);
  if (too_large) return false;
  const int type = png_get_color_type(png, info), bits = png_get_bit_depth(png, info);
  sixteen = bits == 16;
  colour = (type & PNG_COLOR_MASK_COLOR) != 0;
  if (type == PNG_COLOR_TYPE_PALETTE) png_set_palette_to_rgb(png);
  if (type == PNG_COLOR_TYPE_GRAY && bits < 8) png_set_expand_gray_1_2_4_to_8(png);
  png_set_strip_alpha(png);
  if (sixteen) png_set_swap(png);
  png_set_interlace_handling(png);
  png_read_update_info(png, info);
  const std::size_t stride = png_get_rowbytes(png, info);
  decoded.resize(stride * height);
  rows.resize(height);
  for (std::size_t row = 0; row < height; ++row) rows[row] = decoded.data() + row * stride;
  png_read_image(png, rows.data());
  png_read_end(png, nullptr);
  return true;
}

template <class Sample>
std::vector<float> grey_of(const Sample* samples, std::size_t pixels, int channels, float white) {
  std::vector<float> grey(pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    const Sample* pixel = samples + i * static_cast<std::size_t>(channels);
    // Rounded to integer sample values, as image libraries do when they convert colour to grey.
    const float value =
        channels == 1 ? static_cast<float>(pixel[0]) : std::floor(luma(pixel[0], pixel[1], pixel[2]) + 0.5F);
    grey[i] = value / white;
  }
  return grey;
}

GreyPixels decode_png(std::string_view bytes, std::size_t most) {
  std::string message;
  PngSource source{bytes};
  std::vector<std::uint8_t> decoded;
  std::vector<png_bytep> rows;
  bool sixteen = false, colour = false, too_large = false;
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &message, png_failed, png_warned);
  png_infop info = png_create_info_struct(png);
  const bool read = read_png_rows(png, info, source, most, decoded, rows, sixteen, colour, too_large);
  const std::size_t width = png_get_image_width(png, info), height = png_get_image_height(png, info);
  png_destroy_read_struct(&png, &info, nullptr);
  if (too_large) refuse_large(width, height, most);
  if (!read) damaged(message);
  const int channels = colour ? 3 : 1;
  GreyPixels out{width, height, {}};
  out.values = sixteen
                   ? grey_of(reinterpret_cast<const std::uint16_t*>(decoded.data()), width * height, channels, 65535.0F)
                   : grey_of(decoded.data(), width * height, channels, 255.0F);
  return out;
}

// ---- JPEG ----------------------------------------------------------------------------------------

struct JpegErrors {
  jpeg_error_mgr base;
  std::jmp_buf leave;
  char message[JMSG_LENGTH_MAX];
};

[[noreturn]] void jpeg_failed(j_common_ptr jpeg) {
  auto* errors = reinterpret_cast<JpegErrors*>(jpeg->err);
  jpeg->err->format_message(jpeg, errors->message);
  std::longjmp(errors->leave, 1);
}

// libjpeg only warns of a damaged stream and fills the rest with grey; here it is an error.
void jpeg_warned(j_common_ptr jpeg, int level) {
  if (level < 0) jpeg_failed(jpeg);
}

bool read_jpeg_rows(jpeg_decompress_struct& jpeg, JpegErrors& errors, std::string_view bytes, std::size_t most,
                    std::vector<std::uint8_t>& decoded, bool& too_large) {
  if (setjmp(errors.leave) != 0) return false;
  jpeg_create_decompress(&jpeg);
  jpeg_mem_src(&jpeg, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  jpeg_read_header(&jpeg, TRUE);
  too_large = is_too_large(jpeg.image_width, jpeg.image_height, most);
  if (too_large) return false;
  jpeg.out_color_space = JCS_GRAYSCALE;
  jpeg_start_decompress(&jpeg);
  decoded.resize(std::size_t{jpeg.output_width} * jpeg.output_height);
  while (jpeg.output_scanline < jpeg.output_height) {
    std::uint8_t* row = decoded.data() + std::size_t{jpeg.output_scanline} * jpeg.output_width;
    jpeg_read_scanlines(&jpeg, &row, 1);
  }
  jpeg_finish_decompress(&jpeg);
  return true;
}

GreyPixels decode_jpeg(std::string_view bytes, std::size_t most) {
  JpegErrors errors{};
  jpeg_decompress_struct jpeg{};
  jpeg.err = jpeg_std_error(&errors.base);
  errors.base.error_exit = jpeg_failed;
  errors.base.emit_message = jpeg_warned;
  std::vector<std::uint8_t> decoded;
  bool too_large = false;
  const bool read = read_jpeg_rows(jpeg, errors, bytes, most, decoded, too_large);
  const std::size_t width = jpeg.image_width, height = jpeg.image_height;
  jpeg_destroy_decompress(&jpeg);
  if (too_large) refuse_large(width, height, most);
  if (!read) damaged(errors.message);
  return {width, height, grey_of(decoded.data(), width * height, 1, 255.0F)};
}

// ---- WebP ----------------------------------------------------------------------------------------

GreyPixels decode_webp(std::string_view bytes, std::size_t most) {
  const auto* data = reinterpret_cast<const std::uint8_t*>(bytes.data());
  int width = 0, height = 0;
  if (WebPGetInfo(data, bytes.size(), &width, &height) == 0) damaged("its header is damaged");
  refuse_large(static_cast<std::size_t>(width), static_cast<std::size_t>(height), most);
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  std::vector<std::uint8_t> rgb(pixels * 3);
  if (WebPDecodeRGBInto(data, bytes.size(), rgb.data(), rgb.size(), width * 3) == nullptr)
    damaged("its data are damaged");
  return {static_cast<std::size_t>(width), static_cast<std::size_t>(height), grey_of(rgb.data(), pixels, 3, 255.0F)};
}

bool begins(std::string_view bytes, std::string_view with) { return bytes.substr(0, with.size()) == with; }

}  // namespace

std::string encode_png(const Samples& samples) {
  const bool sixteen = !samples.sixteen.empty();
  std::string bytes, message;
  std::vector<png_bytep> rows(samples.height);
  const std::size_t in_row = samples.width * static_cast<std::size_t>(samples.channels);
  for (std::size_t row = 0; row < samples.height; ++row)
    rows[row] =
        const_cast<png_bytep>(sixteen ? reinterpret_cast<const std::uint8_t*>(samples.sixteen.data() + row * in_row)
                                      : samples.eight.data() + row * in_row);
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &message, png_failed, png_warned);
  png_infop info = png_create_info_struct(png);
  if (setjmp(png_jmpbuf(png)) != 0) {
    png_destroy_write_struct(&png, &info);
    throw Error(ErrorKind::internal, "libpng cannot write the image: " + message);
  }
  png_set_write_fn(png, &bytes, png_append, png_flush_nothing);
  // Fast rather than small: these images have long runs of equal differences.
  png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
  png_set_compression_level(png, 1);
  png_set_compression_strategy(png, 3);  // Z_RLE
  png_set_IHDR(png, info, static_cast<png_uint_32>(samples.width), static_cast<png_uint_32>(samples.height),
               sixteen ? 16 : 8, samples.channels == 1 ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  if (sixteen) png_set_swap(png);
  png_write_image(png, rows.data());
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  return bytes;
}

std::string encode_webp(const Samples& grey, float quality) {
  std::vector<std::uint8_t> rgb(grey.width * grey.height * 3);
  for (std::size_t i = 0; i < grey.width * grey.height; ++i)
    std::fill_n(rgb.begin() + static_cast<long>(i) * 3, 3, grey.eight[i]);
  std::uint8_t* encoded = nullptr;
  const std::size_t size = WebPEncodeRGB(rgb.data(), static_cast<int>(grey.width), static_cast<int>(grey.height),
                                         static_cast<int>(grey.width) * 3, quality, &encoded);
  if (size == 0) throw Error(ErrorKind::internal, "libwebp cannot write the image");
  std::string bytes(reinterpret_cast<const char*>(encoded), size);
  WebPFree(encoded);
  return bytes;
}

GreyPixels decode_grey(std::string_view bytes, std::size_t most_pixels) {
  if (begins(bytes, "\x89PNG\r\n\x1a\n")) return decode_png(bytes, most_pixels);
  if (begins(bytes, "\xff\xd8\xff")) return decode_jpeg(bytes, most_pixels);
  if (begins(bytes, std::string_view("II*\0", 4)) || begins(bytes, std::string_view("MM\0*", 4)))
    return decode_tiff(bytes, most_pixels);
  if (begins(bytes, "RIFF") && bytes.size() > 12 && bytes.substr(8, 4) == "WEBP")
    return decode_webp(bytes, most_pixels);
  throw Error(ErrorKind::bad_input, "not an image that can be read; allowed: PNG, JPEG, TIFF, WebP");
}

}  // namespace relign::images
