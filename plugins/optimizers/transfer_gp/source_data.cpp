#include "source_data.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <stdexcept>

namespace transfer_gp {
namespace {

constexpr char kTitle[] = "relign transfer-gp 1\n";
constexpr std::size_t kTitleSize = sizeof kTitle - 1;

[[noreturn]] void refuse(const std::string& what) {
  throw std::runtime_error("cannot use the pretraining data: " + what +
                           "; recreate them with relign-bench plugin prepare transfer-gp --again");
}

// 8 bytes at a time, because the data have megabytes.
std::uint64_t checksum(const char* bytes, std::size_t count) {
  std::uint64_t sum = 0xcbf29ce484222325U ^ count;
  for (std::size_t at = 0; at < count; at += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes + at, std::min<std::size_t>(8, count - at));
    sum = (sum ^ word) * 0x100000001b3U;
    sum ^= sum >> 29;
  }
  return sum;
}

class Writer {
 public:
  void number(std::uint64_t value) { bytes_.append(reinterpret_cast<const char*>(&value), sizeof value); }
  template <class Array>
  void array(const Array& values) {
    number(static_cast<std::uint64_t>(values.rows()));
    number(static_cast<std::uint64_t>(values.cols()));
    bytes_.append(reinterpret_cast<const char*>(values.data()),
                  static_cast<std::size_t>(values.size()) * sizeof(typename Array::Scalar));
  }
  std::string bytes_;
};

class Reader {
 public:
  Reader(const char* bytes, std::size_t count) : at_(bytes), left_(count) {}

  std::uint64_t number() {
    std::uint64_t value = 0;
    take(&value, sizeof value);
    return value;
  }
  template <class Array>
  void array(Array& values) {
    const std::uint64_t rows = number(), columns = number();
    constexpr std::uint64_t most = std::uint64_t{1} << 32;
    if (rows > most || columns > most || (columns > 0 && rows > left_ / sizeof(typename Array::Scalar) / columns))
      refuse("truncated");
    values.resize(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(columns));
    take(values.data(), rows * columns * sizeof(typename Array::Scalar));
  }
  bool at_end() const { return left_ == 0; }

 private:
  void take(void* to, std::size_t count) {
    if (count > left_) refuse("truncated");
    if (count > 0) std::memcpy(to, at_, count);
    at_ += count;
    left_ -= count;
  }
  const char* at_;
  std::size_t left_;
};

void check(const SourceData& data) {
  const auto d = static_cast<Eigen::Index>(data.dimensions);
  Eigen::Index all = 0;
  for (const Source& source : data.sources) {
    all += source.merits.size();
    const bool fits = source.points.rows() == d && source.points.cols() == source.merits.size() &&
                      source.merits.size() > 0 && source.theta.size() == (data.finished ? d + 2 : 0);
    if (!fits || !source.points.allFinite() || !source.merits.allFinite() || !source.theta.allFinite())
      refuse("incomplete source");
  }
  const Candidates& candidates = data.candidates;
  const Eigen::Index m = candidates.points.cols();
  const auto feature = [&](const Eigen::MatrixXf& rows) {
    return rows.cols() == m && (rows.rows() == 0 || rows.rows() == all) && rows.allFinite();
  };
  if (data.dimensions == 0 || data.sources.empty()) refuse("no sources");
  if (data.finished && (candidates.points.rows() != d || m == 0 || candidates.mean.size() != m ||
                        candidates.variance.size() != m || !feature(candidates.white) || !feature(candidates.excess)))
    refuse("incomplete candidates");
}

}  // namespace

double Scale::operator()(double merit) const {
  if (unit > 0) {
    const double above = (merit - middle) / unit;
    merit = above > 0 ? std::log1p(above) : above;
  }
  return (merit - standard.mean) / standard.scale;
}

Scale SourceData::scale() const {
  std::vector<double> all;
  for (const Source& source : sources) all.insert(all.end(), source.merits.begin(), source.merits.end());
  Scale scale;
  if (compress) {
    std::sort(all.begin(), all.end());
    scale.middle = all[all.size() / 2];
    scale.unit = scale.middle - all[all.size() / 10];  // 0 for constant merits: no compression
  }
  scale.standard =
      surrogates::Standard(scale(Eigen::Map<const Vector>(all.data(), static_cast<Eigen::Index>(all.size()))));
  return scale;
}

std::string SourceData::to_bytes() const {
  Writer writer;
  writer.number(dimensions);
  writer.number(finished ? 1 : 0);
  writer.number(compress ? 1 : 0);
  writer.number(sources.size());
  for (const Source& source : sources) {
    writer.array(source.points);
    writer.array(source.merits);
    writer.array(source.theta);
  }
  writer.array(candidates.points);
  writer.array(candidates.mean);
  writer.array(candidates.variance);
  writer.array(candidates.white);
  writer.array(candidates.excess);
  Writer sum;
  sum.number(checksum(writer.bytes_.data(), writer.bytes_.size()));
  return kTitle + sum.bytes_ + writer.bytes_;
}

SourceData SourceData::from_bytes(const std::string& bytes) {
  constexpr std::size_t head = kTitleSize + sizeof(std::uint64_t);
  if (bytes.size() < head || bytes.compare(0, kTitleSize, kTitle) != 0) refuse("not written by transfer-gp");
  Reader sum(bytes.data() + kTitleSize, sizeof(std::uint64_t));
  if (sum.number() != checksum(bytes.data() + head, bytes.size() - head)) refuse("wrong checksum");
  Reader reader(bytes.data() + head, bytes.size() - head);
  SourceData data;
  data.dimensions = static_cast<std::size_t>(reader.number());
  data.finished = reader.number() == 1;
  data.compress = reader.number() == 1;
  const std::uint64_t count = reader.number();
  for (std::uint64_t number = 0; number < count; ++number) {
    Source source;
    reader.array(source.points);
    reader.array(source.merits);
    reader.array(source.theta);
    data.sources.push_back(std::move(source));
  }
  reader.array(data.candidates.points);
  reader.array(data.candidates.mean);
  reader.array(data.candidates.variance);
  reader.array(data.candidates.white);
  reader.array(data.candidates.excess);
  if (!reader.at_end()) refuse("unexpected bytes at the end");
  check(data);
  return data;
}

SourceModel model_of(const SourceData& data, Shape shape, Stacking stacking) {
  SourceModel model(shape, stacking);
  const Scale scale = data.scale();
  for (const Source& source : data.sources)
    if (!model.append(source.points, scale(source.merits), source.theta))
      refuse("hyperparameters give an indefinite covariance matrix");
  return model;
}

}  // namespace transfer_gp
