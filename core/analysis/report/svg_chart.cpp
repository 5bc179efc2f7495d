#include "report/svg_chart.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "base/text.h"
#include "markup/escape.h"
#include "report/page_numbers.h"

namespace relign::report {
namespace {

constexpr double kLabelHeight = 12, kCharacter = 6.1, kMaxLabelCharacters = 20;
constexpr double kLeft = 54, kBottom = 42, kTitle = 22, kMargin = 8;
constexpr const char* kInk = "#3a3f47";

bool drawable(double value) { return std::isfinite(value); }

struct Span {
  double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();
  void add(double value, bool positive_only) {
    if (!drawable(value) || (positive_only && value <= 0)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  bool empty() const { return low > high; }
};

// The displayed range of an axis: from the data, with a margin, unless the chart sets it.
struct Range {
  double low = 0, high = 1;
  bool logarithmic = false;
};

Range range_of(const ChartAxis& axis, const std::vector<double>& values, bool airy) {
  if (!axis.categories.empty()) return {-0.5, static_cast<double>(axis.categories.size()) - 0.5, false};
  Span span;
  bool logarithmic = axis.logarithmic;
  for (const double value : values) span.add(value, logarithmic);
  if (span.empty() && logarithmic) {
    logarithmic = false;
    for (const double value : values) span.add(value, false);
  }
  if (span.empty()) span.low = 0, span.high = 1;
  Range range = {span.low, span.high, logarithmic};
  if (logarithmic) {
    if (range.high < range.low * 1.5) range.low /= 1.5, range.high *= 1.5;
    const double air = airy ? std::pow(range.high / range.low, 0.05) : 1;
    range.low /= air, range.high *= air;
  } else {
    if (airy && range.low > 0) range.low = 0;
    if (!(range.high > range.low)) range.high = range.low + std::max(1.0, std::fabs(range.low));
    if (airy) range.high += 0.05 * (range.high - range.low);
  }
  if (drawable(axis.low) && (!logarithmic || axis.low > 0)) range.low = axis.low;
  if (drawable(axis.high) && axis.high > range.low) range.high = axis.high;
  return range;
}

double last_y(const ChartSeries& series) {
  for (auto point = series.points.rbegin(); point != series.points.rend(); ++point)
    if (drawable(point->x) && drawable(point->y)) return point->y;
  return std::numeric_limits<double>::quiet_NaN();
}

class Drawing {
 public:
  Drawing(HtmlWriter& html, const Chart& chart) : html_(html), chart_(chart) {
    std::vector<double> xs, ys;
    double longest = 0;
    for (const ChartSeries& series : chart.series) {
      for (const ChartPoint& point : series.points) {
        xs.push_back(point.x);
        for (const double y : {point.y, point.low, point.high}) ys.push_back(y);
      }
      longest = std::max(longest, static_cast<double>(columns(series.name)));
    }
    for (const ChartLevel& level : chart.levels) ys.push_back(level.y);
    right_ = chart.width - kMargin - 8 - kCharacter * std::min(longest, kMaxLabelCharacters);
    top_ = kMargin + kTitle;
    bottom_ = chart.height - kBottom;
    const Range x = range_of(chart.x, xs, false), y = range_of(chart.y, ys, true);
    x_.emplace(x.low, x.high, x.logarithmic, kLeft, right_);
    y_.emplace(y.low, y.high, y.logarithmic, bottom_, top_);
  }

  void draw() {
    const std::string width = pixels_text(chart_.width), height = pixels_text(chart_.height);
    html_
        .open("svg", {{"xmlns", "http://www.w3.org/2000/svg"},
                      {"class", "figure"},
                      {"viewBox", "0 0 " + width + " " + height},
                      {"role", "img"},
                      {"aria-label", chart_.title},
                      {"font-size", "11"},
                      {"fill", "none"},
                      {"width", width},
                      {"height", height},
                      {"font-family", "Helvetica, Arial, sans-serif"}})
        .text("\n");
    html_.element("title", chart_.title);
    html_.empty("rect", {{"width", width}, {"height", height}, {"fill", "#ffffff"}}).text("\n");
    group(kInk);
    text(kLeft, kMargin + 11, chart_.title, "start", {{"font-weight", "600"}, {"font-size", "13"}});
    html_.close();
    axes();
    // Bands below all lines.
    for (const ChartSeries& series : chart_.series) band(series);
    for (const ChartLevel& level : chart_.levels) draw_level(level);
    for (std::size_t i = chart_.series.size(); i-- > 0;) draw_series(chart_.series[i], i);
    end_labels();
    html_.close().text("\n");
  }

 private:
  void group(const std::string& colour) { html_.open("g", {{"color", colour}}); }
  void series_group(const ChartSeries& series) {
    const std::size_t count = series_colours().size();
    group(series.style < 0 ? "#6a7380" : series_colours()[static_cast<std::size_t>(series.style) % count]);
  }

  void text(double x, double y, const std::string& words, const char* anchor, const Attributes& more = {}) {
    Attributes attributes = {{"x", pixels_text(x)}, {"y", pixels_text(y)}, {"fill", "currentColor"}};
    if (std::string_view(anchor) != "start") attributes.emplace_back("text-anchor", anchor);
    attributes.insert(attributes.end(), more.begin(), more.end());
    html_.element("text", attributes, words);
  }

  void path(const std::string& d, const Attributes& more) {
    Attributes attributes = {{"d", d}};
    attributes.insert(attributes.end(), more.begin(), more.end());
    html_.empty("path", attributes);
  }

  void axes() {
    std::string grid, frame = "M" + pixels_text(kLeft) + " " + pixels_text(top_) + "V" + pixels_text(bottom_) + "H" +
                              pixels_text(right_);
    group(kInk);
    const auto mark_x = [&](double value, const std::string& words) {
      const double place = (*x_)(value);
      frame += "M" + pixels_text(place) + " " + pixels_text(bottom_) + "v4";
      text(place, bottom_ + 16, words, "middle");
    };
    if (chart_.x.categories.empty()) {
      for (const auto& [value, words] : x_->marks(static_cast<int>((right_ - kLeft) / 45), chart_.x.whole))
        mark_x(value, words);
    } else {
      const double room = (right_ - kLeft) / static_cast<double>(chart_.x.categories.size());
      const auto most = static_cast<std::size_t>(std::max(4.0, room / kCharacter));
      for (std::size_t i = 0; i < chart_.x.categories.size(); ++i)
        mark_x(static_cast<double>(i), clipped(chart_.x.categories[i], most));
    }
    for (const auto& [value, words] : y_->marks(6, chart_.y.whole)) {
      const double place = (*y_)(value);
      grid += "M" + pixels_text(kLeft) + " " + pixels_text(place) + "H" + pixels_text(right_);
      text(kLeft - 6, place + 4, words, "end");
    }
    if (!grid.empty()) path(grid, {{"stroke", "currentColor"}, {"stroke-opacity", "0.18"}});
    path(frame, {{"stroke", "currentColor"}, {"stroke-opacity", "0.6"}});
    text((kLeft + right_) / 2, bottom_ + 33, chart_.x.title, "middle");
    const double middle = (top_ + bottom_) / 2;
    text(11, middle, chart_.y.title, "middle", {{"transform", "rotate(-90 11 " + pixels_text(middle) + ")"}});
    html_.close().text("\n");
  }

  static bool has_marks(const ChartSeries& series) {
    return series.drawn == Drawn::marks || series.drawn == Drawn::marked_line;
  }

  // The x of a point: marks of one category are placed side by side.
  double place(const ChartPoint& point, std::size_t index) const {
    const double x = (*x_)(point.x);
    if (chart_.x.categories.empty() || chart_.series.size() < 2) return x;
    const auto count = static_cast<double>(chart_.series.size());
    const double slot = (right_ - kLeft) / static_cast<double>(chart_.x.categories.size());
    return x + (static_cast<double>(index) - (count - 1) / 2) * std::min(9.0, 0.7 * slot / count);
  }

  void band(const ChartSeries& series) {
    if (has_marks(series)) return;
    std::string upper, lower;
    for (const ChartPoint& point : series.points) {
      if (!drawable(point.low) || !drawable(point.high)) continue;
      const std::string x = pixels_text((*x_)(point.x));
      upper += (upper.empty() ? "M" : "L") + x + " " + pixels_text((*y_)(point.high));
      lower.insert(0, "L" + x + " " + pixels_text((*y_)(point.low)));
    }
    if (upper.empty()) return;
    series_group(series);
    path(upper + lower + "Z", {{"fill", "currentColor"}, {"fill-opacity", "0.14"}});
    html_.close();
  }

  std::string line(const ChartSeries& series, std::size_t index) const {
    std::string d;
    double before = 0;
    bool pen_down = false;
    for (const ChartPoint& point : series.points) {
      if (!drawable(point.x) || !drawable(point.y)) {
        pen_down = false;
        continue;
      }
      const std::string x = pixels_text(place(point, index)), y = pixels_text((*y_)(point.y));
      if (!pen_down)
        d += "M" + x + " " + y;
      else if (series.drawn == Drawn::steps)
        d += "H" + x + (point.y == before ? "" : "V" + y);
      else
        d += "L" + x + " " + y;
      before = point.y;
      pen_down = true;
    }
    return d;
  }

  void draw_series(const ChartSeries& series, std::size_t index) {
    series_group(series);
    html_.element("title", series.name);
    if (series.drawn != Drawn::marks) {
      Attributes look = {{"fill", "none"}, {"stroke", "currentColor"}, {"stroke-width", "1.7"}};
      const std::string dash = series_dash(series.style);
      if (!dash.empty()) look.emplace_back("stroke-dasharray", dash);
      if (const std::string d = line(series, index); !d.empty()) path(d, look);
    }
    if (has_marks(series)) {
      std::string bars;
      for (const ChartPoint& point : series.points) {
        if (!drawable(point.y)) continue;
        const std::string x = pixels_text(place(point, index));
        html_.empty("circle", {{"cx", x}, {"cy", pixels_text((*y_)(point.y))}, {"r", "3"}, {"fill", "currentColor"}});
        if (drawable(point.low) && drawable(point.high))
          bars += "M" + x + " " + pixels_text((*y_)(point.low)) + "V" + pixels_text((*y_)(point.high));
      }
      if (!bars.empty()) path(bars, {{"stroke", "currentColor"}, {"stroke-width", "1.4"}});
    }
    html_.close().text("\n");
  }

  void draw_level(const ChartLevel& level) {
    if (!drawable(level.y)) return;
    const double y = (*y_)(level.y);
    group(kInk);
    path("M" + pixels_text(kLeft) + " " + pixels_text(y) + "H" + pixels_text(right_),
         {{"stroke", "currentColor"}, {"stroke-dasharray", level.dotted ? "1.5 3" : "7 4"}});
    // Below its line if another line is close above, whose label is between the two.
    const bool crowded = std::any_of(chart_.levels.begin(), chart_.levels.end(), [&](const ChartLevel& other) {
      const double gap = drawable(other.y) ? y - (*y_)(other.y) : 0;
      return gap > 0 && gap < kLabelHeight;
    });
    text(kLeft + 4, crowded ? y + 10 : y - 3, level.label, "start", {{"font-size", "10"}});
    html_.close();
  }

  void end_labels() {
    std::vector<double> wanted;
    for (const ChartSeries& series : chart_.series) wanted.push_back((*y_)(last_y(series)));
    const std::vector<double> places = spread_labels(wanted, top_ + 4, bottom_, kLabelHeight);
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (!drawable(places[i])) continue;
      series_group(chart_.series[i]);
      path("M" + pixels_text(right_ + 1) + " " + pixels_text(wanted[i]) + "L" + pixels_text(right_ + 6) + " " +
               pixels_text(places[i]),
           {{"stroke", "currentColor"}, {"stroke-opacity", "0.6"}});
      text(right_ + 8, places[i] + 3.5, clipped(chart_.series[i].name, static_cast<std::size_t>(kMaxLabelCharacters)),
           "start");
      html_.close();
    }
  }

  HtmlWriter& html_;
  const Chart& chart_;
  double right_ = 0, top_ = 0, bottom_ = 0;
  std::optional<ChartScale> x_, y_;
};

}  // namespace

std::string chart_svg(const Chart& chart) {
  HtmlWriter html;
  Drawing(html, chart).draw();
  return html.take();
}

namespace {

constexpr double kSlack = 1e-9;
constexpr double kNoDecade = 0.8;    // below this, tick marks as on a linear axis
constexpr double kFewDecades = 2.2;  // below this, tick marks at 2 and 5 as well
constexpr int kTickDigits = 6;       // hides rounding errors as of k * 0.1

std::string tick_text(double value) {
  const std::string text = shortest(rounded(value, kTickDigits));
  return text == "-0" ? "0" : text;
}

double round_step(double least) {
  const double power = std::pow(10.0, std::floor(std::log10(least)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (factor * power >= least * (1 - kSlack)) return factor * power;
  return 10 * power;
}

}  // namespace

ChartScale::ChartScale(double low, double high, bool logarithmic, double from, double to)
    : low_(logarithmic ? std::log10(low) : low),
      high_(logarithmic ? std::log10(high) : high),
      from_(from),
      to_(to),
      logarithmic_(logarithmic) {}

double ChartScale::operator()(double value) const {
  if (std::isnan(value)) return value;
  if (logarithmic_) value = value > 0 ? std::log10(value) : low_;
  return from_ + (to_ - from_) * (std::clamp(value, low_, high_) - low_) / (high_ - low_);
}

std::vector<std::pair<double, std::string>> ChartScale::marks(int count, bool whole) const {
  std::vector<std::pair<double, std::string>> all;
  const auto add = [&](double value) { all.emplace_back(value, tick_text(value)); };
  if (!logarithmic_) {
    double step = round_step((high_ - low_) / count);
    if (whole) step = std::max(step, 1.0);
    for (double k = std::ceil(low_ / step - kSlack); k * step <= high_ + kSlack * step; ++k) add(k * step);
    return all;
  }
  if (high_ - low_ < kNoDecade) {
    const double low = std::pow(10.0, low_), high = std::pow(10.0, high_);
    const double step = std::max(round_step((high - low) / count), whole ? 1.0 : 0.0);
    for (double k = std::ceil(low / step - kSlack); k * step <= high * (1 + kSlack); ++k) add(k * step);
    return all;
  }
  const bool fine = high_ - low_ < kFewDecades;
  // Over many decades only every second or third has a mark.
  const int every = std::max(1, static_cast<int>(std::ceil((high_ - low_) / count)));
  for (int power = static_cast<int>(std::floor(low_)); power <= high_; ++power)
    for (const double factor : {1.0, 2.0, 5.0}) {
      if (factor > 1 && !fine) continue;
      if (factor == 1 && !fine && power % every != 0) continue;
      const double place = power + std::log10(factor);
      if (place < low_ - kSlack || place > high_ + kSlack) continue;
      if (!whole || place > -kSlack) add(factor * std::pow(10.0, power));
    }
  return all;
}

std::string pixels_text(double value) {
  const double tenths = std::round(value * 10) / 10;
  return shortest(tenths == 0 ? 0.0 : tenths);
}

std::vector<double> spread_labels(const std::vector<double>& wanted, double top, double bottom, double height) {
  std::vector<double> places(wanted.size(), std::numeric_limits<double>::quiet_NaN());
  std::vector<std::size_t> order;
  const double room = bottom < top ? 0 : std::floor((bottom - top) / height) + 1;
  for (std::size_t i = 0; i < wanted.size() && static_cast<double>(order.size()) < room; ++i)
    if (std::isfinite(wanted[i])) order.push_back(i);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return wanted[a] < wanted[b]; });
  double least = top;
  for (const std::size_t i : order) {
    places[i] = std::max(wanted[i], least);
    least = places[i] + height;
  }
  double most = bottom;
  for (auto i = order.rbegin(); i != order.rend(); ++i) {
    places[*i] = std::min(places[*i], most);
    most = places[*i] - height;
  }
  return places;
}

}  // namespace relign::report
