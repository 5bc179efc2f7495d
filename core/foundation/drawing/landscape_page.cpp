// The landscape as a page and as a table.
#include <algorithm>

#include "base/text.h"
#include "drawing/landscape.h"
#include "markup/escape.h"
#include "markup/html_writer.h"

namespace relign::drawing {
namespace {

constexpr const char* kStyle = R"(
body { margin: 16px; font: 14px/1.4 Helvetica, Arial, sans-serif; color: #222831; background: #fff; }
svg { max-width: 100%; height: auto; }
#words { position: fixed; display: none; padding: 6px 9px; border-radius: 4px; background: #222831; color: #fff;
  font-size: 13px; white-space: pre; pointer-events: none; }
)";

constexpr const char* kScript = R"(
(function () {
  'use strict';
  const data = JSON.parse(document.getElementById('values').textContent);
  const svg = document.querySelector('svg'), words = document.getElementById('words');
  const physical = (axis, k) => axis.lower + (axis.upper - axis.lower) * k / (data.points - 1);
  const label = (axis, k) => axis.name + ' ' + Number(physical(axis, k).toPrecision(4)) + ' ' + axis.unit;
  svg.addEventListener('mousemove', (event) => {
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
    const plane = data.planes.find((p) => at.x >= p.x && at.x <= p.x + p.side && at.y >= p.y && at.y <= p.y + p.side);
    words.style.display = plane ? 'block' : 'none';
    if (!plane) return;
    const column = Math.round((at.x - plane.x) / plane.side * (data.points - 1));
    const row = Math.round((1 - (at.y - plane.y) / plane.side) * (data.points - 1));
    words.textContent = data.measure + ' ' + plane.values[row * data.points + column].toPrecision(4) + '\n' +
      label(data.axes[plane.across], column) + '\n' + label(data.axes[plane.up], row);
    words.style.left = Math.min(event.clientX + 14, window.innerWidth - words.offsetWidth - 8) + 'px';
    words.style.top = Math.min(event.clientY + 14, window.innerHeight - words.offsetHeight - 8) + 'px';
  });
  svg.addEventListener('mouseleave', () => { words.style.display = 'none'; });
  // Titles of groups would cover this tooltip.
  svg.querySelectorAll('title').forEach((title) => title.remove());
})();
)";

Json values_of(const Landscape& landscape) {
  const LandscapeLayout layout(landscape.axes.size());
  Json data = {{"measure", landscape.measure}, {"points", landscape.points}, {"axes", Json::array()}};
  for (const LandscapeAxis& axis : landscape.axes)
    data["axes"].push_back({{"name", axis.name}, {"unit", axis.unit}, {"lower", axis.lower}, {"upper", axis.upper}});
  for (const LandscapePlane& plane : landscape.planes) {
    const Rectangle panel = layout.panel(plane.across, plane.up);
    Json values = Json::array();
    for (const double value : plane.values) values.push_back(static_cast<float>(value));
    data["planes"].push_back({{"across", plane.across},
                              {"up", plane.up},
                              {"x", panel.x},
                              {"y", panel.y},
                              {"side", panel.width},
                              {"values", values}});
  }
  return data;
}

}  // namespace

std::string landscape_page(const Landscape& landscape) {
  HtmlWriter head;
  head.element("title", landscape.title);
  // All text from outside is escaped: in the drawing, and in JSON for scripts.
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n" + head.take() + "\n<style>" +
         kStyle + "</style>\n</head>\n<body>\n" + landscape_svg(landscape) + "<div id=\"words\"></div>\n" +
         "<script type=\"application/json\" id=\"values\">" + json_for_script(values_of(landscape)) +
         "</script>\n<script>" + kScript + "</script>\n</body>\n</html>\n";
}

std::string landscape_table(const Landscape& landscape) {
  std::string text = "axis_1,axis_2,value_1,value_2,share_1,share_2,unit_1,unit_2," + landscape.measure;
  const bool sloped = std::ranges::any_of(landscape.planes, [](const auto& plane) { return !plane.slopes.empty(); });
  text += sloped ? ",gradient_1,gradient_2\n" : "\n";
  const auto points = static_cast<std::size_t>(landscape.points);
  for (const LandscapePlane& plane : landscape.planes) {
    const LandscapeAxis &across = landscape.axes[plane.across], &up = landscape.axes[plane.up];
    for (std::size_t place = 0; place < plane.values.size(); ++place) {
      const double u = static_cast<double>(place % points) / static_cast<double>(points - 1);
      const double v = static_cast<double>(place / points) / static_cast<double>(points - 1);
      const auto physical = [](const LandscapeAxis& axis, double share) {
        return shortest(axis.lower + share * (axis.upper - axis.lower));
      };
      text += across.name + "," + up.name + "," + physical(across, u) + "," + physical(up, v) + "," + shortest(u) +
              "," + shortest(v) + "," + across.unit + "," + up.unit + "," + shortest(plane.values[place]);
      if (const auto slope = plane.slopes.find(place); slope != plane.slopes.end())
        text += "," + shortest(slope->second.x) + "," + shortest(slope->second.y);
      else if (sloped)
        text += ",,";
      text += "\n";
    }
  }
  return text;
}

}  // namespace relign::drawing
