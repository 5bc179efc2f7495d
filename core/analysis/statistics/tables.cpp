// curves.csv, curves.json and instances.csv as text.
#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "statistics/curves.h"

namespace relign::statistics {
namespace {

std::string field(double value) { return std::isfinite(value) ? shortest(value) : ""; }

// RFC 4180: quoted if necessary.
std::string field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char letter : text) {
    if (letter == '"') quoted += '"';
    quoted += letter;
  }
  return quoted + '"';
}

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

// Tracebacks have several lines; tables keep one line per row. The record has the original.
std::string one_line(std::string text) {
  for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos; at += 3) text.replace(at, 1, " / ");
  return text;
}

// Further scores only of scenes that declare some, so that other tables keep their bytes.
template <class Has>
std::vector<Criterion> criteria_shown(const Has& has) {
  std::vector<Criterion> shown;
  for (const Criterion one : kCriteria)
    if (!is_further_score(one) || has(one)) shown.push_back(one);
  return shown;
}

}  // namespace

std::string curves_csv(const std::vector<Curve>& curves) {
  std::string csv = "scene,noise_level,protocol,algorithm,step,n";
  for (std::size_t track = 0; track < kTracks.size(); ++track) {
    if (track == kTracksBeforeTheClock) csv += ",machine_seconds_median";
    for (const char* column : {"_median", "_q25", "_q75", "_mean", "_lo95", "_hi95"})
      csv += std::string(",") + track_name(kTracks[track]) + column;
  }
  // Only with criteria that are judged after every step, so that other tables keep their bytes.
  const bool judged = std::any_of(curves.begin(), curves.end(), [](const Curve& curve) {
    return !curve.points.empty() && !std::isnan(curve.points.front().in_spec);
  });
  const std::vector<Criterion> criteria = criteria_shown([&curves](Criterion one) {
    return std::any_of(curves.begin(), curves.end(), [one](const Curve& curve) {
      return !curve.points.empty() && !std::isnan(curve.points.front().criteria[one]);
    });
  });
  if (judged) {
    for (const Criterion one : criteria) csv += "," + std::string(entry_of(one).column) + "_median";
    csv += ",in_spec";
  }
  // Only with a cycle, so that other tables keep their bytes.
  const bool cycle = std::any_of(curves.begin(), curves.end(), [](const Curve& curve) {
    return !curve.points.empty() && !std::isnan(curve.points.front().cycle_seconds);
  });
  if (cycle) csv += ",cycle_seconds_median";
  csv += '\n';
  for (const Curve& curve : curves) {
    const std::string head = field(curve.scene) + ',' + field(curve.noise_level) + ',' + field(curve.protocol) + ',' +
                             field(curve.algorithm) + ',';
    for (const CurvePoint& point : curve.points) {
      csv += head + std::to_string(point.step) + ',' + std::to_string(curve.trials);
      for (std::size_t track = 0; track < kTracks.size(); ++track) {
        const Quantiles& values = point.tracks[track];
        if (track == kTracksBeforeTheClock) csv += ',' + field(point.machine_seconds);
        csv += ',' + field(values.median) + ',' + field(values.q25) + ',' + field(values.q75) + ',' +
               field(values.mean) + ',' + field(point.bands[track].low) + ',' + field(point.bands[track].high);
      }
      if (judged) {
        for (const Criterion one : criteria) csv += ',' + field(point.criteria[one]);
        csv += ',' + field(point.in_spec);
      }
      if (cycle) csv += ',' + field(point.cycle_seconds);
      csv += '\n';
    }
  }
  return csv;
}

Json curves_json(const std::vector<Curve>& curves) {
  Json list = Json::array();
  for (const Curve& curve : curves) {
    Json steps = Json::array(), seconds = Json::array();
    for (const CurvePoint& point : curve.points) {
      steps.push_back(point.step);
      seconds.push_back(number(point.machine_seconds));
    }
    Json tracks = Json::object();
    for (std::size_t track = 0; track < kTracks.size(); ++track) {
      Json columns = {{"n", Json::array()},   {"median", Json::array()}, {"q25", Json::array()},
                      {"q75", Json::array()}, {"mean", Json::array()},   {"lo95", Json::array()},
                      {"hi95", Json::array()}};
      for (const CurvePoint& point : curve.points) {
        const Quantiles& values = point.tracks[track];
        columns["n"].push_back(values.n);
        columns["median"].push_back(number(values.median));
        columns["q25"].push_back(number(values.q25));
        columns["q75"].push_back(number(values.q75));
        columns["mean"].push_back(number(values.mean));
        columns["lo95"].push_back(number(point.bands[track].low));
        columns["hi95"].push_back(number(point.bands[track].high));
      }
      tracks[track_name(kTracks[track])] = std::move(columns);
    }
    list.push_back({{"scene", curve.scene},
                    {"noise_level", curve.noise_level},
                    {"protocol", curve.protocol},
                    {"algorithm", curve.algorithm},
                    {"n", curve.trials},
                    {"failed", curve.failed},
                    {"step", std::move(steps)},
                    {"machine_seconds", std::move(seconds)},
                    {"tracks", std::move(tracks)}});
  }
  return {{"format", records::kFormat}, {"curves", std::move(list)}};
}

void instances_csv(const TrialTable& table, const std::function<void(std::string_view)>& write) {
  std::string csv = "trial,scene,noise_level,protocol,algorithm,instance,end,steps,budget";
  for (std::size_t track = 0; track < kTracksBeforeTheClock; ++track)
    csv += std::string(",") + track_name(kTracks[track]);
  // Only with a specification of MTF, so that other tables keep their bytes.
  const char* mtf_columns =
      table.has_mtf() ? ",mtf_centre,mtf_corner,own_optimum_mtf_centre,own_optimum_mtf_corner" : "";
  records::StepRecord none;
  records::step_columns(
      [&csv](const records::Column& column, const auto&) {
        if (column.is(records::kTabled)) (csv += ',') += column.key;
      },
      none);
  csv += std::string(",recommendation,message") + mtf_columns;
  for (std::size_t track = kTracksBeforeTheClock; track < kTracks.size(); ++track)
    csv += std::string(",") + track_name(kTracks[track]);
  const std::vector<Criterion> criteria = criteria_shown([&table](Criterion one) {
    return std::any_of(table.criteria.begin(), table.criteria.end(),
                       [one](const TrialCriteria& of) { return !std::isnan(of.last[one]); });
  });
  if (table.has_criteria())
    for (const Criterion one : criteria) csv += "," + std::string(entry_of(one).column);
  std::vector<std::size_t> of_trial;  // those that some trial has, so that other tables keep their bytes
  for (std::size_t place = 0; place < table.tabled.size(); ++place)
    if (table.has_tabled(place)) of_trial.push_back(place);
  for (const std::size_t place : of_trial) csv += "," + table.tabled[place];
  write(csv + "\n");
  for (const TrialRow& row : table.rows) {
    const Series& series = table.series_of(row);
    // The last step of a failed trial is where it failed, not what the method reached: such a trial has no scores.
    const auto score = [&row](double value) { return ',' + field(row.counts() ? value : kMissing); };
    csv = row.trial + ',' + field(series.scene) + ',' + field(series.noise_level) + ',' + field(series.protocol) + ',' +
          field(series.algorithm) + ',' + std::to_string(row.instance) + ',' + field(table.text(row.end)) + ',' +
          (row.steps == 0 ? "" : std::to_string(row.last_step)) + ',' + std::to_string(row.budget);
    for (std::size_t track = 0; track < kTracksBeforeTheClock; ++track) csv += score(row.last[track]);
    for (const double value : row.tabled) csv += ',' + field(value);
    csv += ',' + field(table.text(row.recommendation)) + ',' + field(one_line(table.text(row.message)));
    if (table.has_mtf()) {
      const TrialMtf& mtf = table.mtf_of(row);
      const records::MtfRecord& glued = mtf.by[Rule::own][Curing::after];
      csv += score(glued.centre) + score(glued.corner) + ',' + field(mtf.own_optimum.centre) + ',' +
             field(mtf.own_optimum.corner);
    }
    for (std::size_t track = kTracksBeforeTheClock; track < kTracks.size(); ++track) csv += score(row.last[track]);
    if (table.has_criteria())
      for (const Criterion one : criteria) csv += score(table.criteria_of(row).last[one]);
    for (const std::size_t place : of_trial)
      csv += ',' + (row.tabled_of_trial.empty() ? "" : field(row.tabled_of_trial[place]));
    csv += '\n';
    write(csv);
  }
}

}  // namespace relign::statistics
