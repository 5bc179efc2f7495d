// Synthetic statistics in page data, for tests of their presentation.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>

#include "base/json_members.h"
#include "base/json_source.h"

namespace relign::report {

inline Json with_statistics(Json data) {
  data["targets"] = {0.1, 0.05, 0.02, 0.01};
  data["spec"] = {{"rmse", 0.0142}, {"mtf", nullptr}};
  data["spec_text"] = "RMSE 0.0142 at the final pose";
  data["gates"] = {{{"name", "A/A"}, {"ok", true}, {"text", "A/A"}},
                   {{"name", "replay"}, {"ok", true}, {"text", "replay 10/10"}}};
  for (Json& group : data["groups"]) {
    group["spec_rmse"] = 0.0142;
    group["floor"] = {{"own_optimum", 0.0018}, {"next_image", 0.0031}};
    group["ecdf"] = Json::array();
    group["pairs"] = Json::array();
    double rank = 0;
    for (Json& row : group["rows"]) {
      rank += 1;
      const double share = std::max(0.02, 1.05 - 0.25 * rank), median = row["recommended"].value("median", 0.0);
      row["recommended"]["lo95"] = 0.8 * median;
      row["recommended"]["hi95"] = 1.3 * median;
      row["yield"] = {
          {"in", 10 * share}, {"n", 10}, {"share", share}, {"lo95", share * 0.8}, {"hi95", 1 - 0.6 * (1 - share)}};
      row["to_spec"] = {{"successes", 10 * share}, {"n", 10},
                        {"steps", 3 + 4 * rank},   {"lo95", 2 + 4 * rank},
                        {"hi95", 6 + 4 * rank},    {"expected", 4 * rank},
                        {"seconds", 0.4 * rank}};
      if (share < 0.5)
        for (const char* key : {"steps", "lo95", "hi95", "seconds"}) row["to_spec"][key] = "never";
      row["residual"] = {{"axes", Json::array()}};
      for (const char* axis : {"x", "y", "z"})
        row["residual"]["axes"].push_back(
            {{"name", axis}, {"unit", "mm"}, {"median", 0.0008 * rank * (axis[0] - 'w')}, {"q75", 0.003 * rank}});
      for (const char* axis : {"Rx", "Ry"})
        row["residual"]["axes"].push_back(
            {{"name", axis}, {"unit", "deg"}, {"median", 0.01 * rank}, {"q75", 0.04 * rank}});
      Json steps = Json::array(), shares = Json::array();
      for (int step = 0; step <= 30; step += step < 8 ? 1 : 3) {
        steps.push_back(step);
        shares.push_back(share * (1 - std::exp(-step / (3.0 * rank))));
      }
      group["ecdf"].push_back({{"method", row["method"]}, {"steps", steps}, {"share", shares}});
    }
    for (std::size_t a = 0; a < group["rows"].size(); ++a)
      for (std::size_t b = a + 1; b < group["rows"].size(); ++b)
        group["pairs"].push_back({{"a", group["rows"][a]["method"]},
                                  {"b", group["rows"][b]["method"]},
                                  {"n", 10},
                                  {"ratio", 0.7},
                                  {"lo95", 0.5},
                                  {"hi95", 0.95},
                                  {"improvement", 0.8},
                                  {"p", 0.012},
                                  {"p_holm", 0.07},
                                  {"verdict", a == 0 ? "better" : "undecided"}});
    for (Json& curve : group["curves"]) {
      std::size_t count = 0;
      for (auto& [name, track] : curve["tracks"].items()) {
        count = track["median"].size();
        track["lo95"] = track["hi95"] = Json::array();
        for (std::size_t i = 0; i < count; ++i) {
          const bool computed = (i < 8 || i % 5 == 0 || i + 1 == count) && track["median"][i].is_number();
          track["lo95"].push_back(computed ? Json(0.8 * track["median"][i].get<double>()) : Json());
          track["hi95"].push_back(computed ? Json(1.3 * track["median"][i].get<double>()) : Json());
        }
      }
      curve["machine_seconds"] = curve["algorithm_seconds"] = Json::array();
      const double pace = 0.08 + 0.01 * static_cast<double>(text_of(curve, "method").size());
      for (std::size_t i = 0; i < count; ++i) {
        curve["machine_seconds"].push_back(pace * static_cast<double>(i));
        curve["algorithm_seconds"].push_back(0.001 * pace * static_cast<double>(i));
      }
    }
  }
  if (!data["methods"].empty())
    data["training"] = {{{"method", data["methods"][0]["name"]},
                         {"hours", 0.45},
                         {"steps", 12000},
                         {"machine", "a laptop of four cores"},
                         {"pays_after", Json::array()}}};
  for (std::size_t group = 0; !data["methods"].empty() && group < data["groups"].size(); ++group)
    data["training"][0]["pays_after"].push_back({{"group", group},
                                                 {"label", data["groups"][group]["label"]},
                                                 {"lenses", 740},
                                                 {"against", "slow"},
                                                 {"saves", 2.19}});
  return data;
}

}  // namespace relign::report
