#include "report/picture_html.h"

namespace relign::report {
namespace {

// `what`: the text alternative, where no caption is the same.
void picture_figure(HtmlWriter& html, std::size_t picture, const std::string& view, const std::string& what = "") {
  Attributes attributes = {{"viewBox", view}};
  if (!what.empty()) attributes.insert(attributes.end(), {{"role", "img"}, {"aria-label", what}});
  html.open("svg", attributes);
  html.empty("use", {{"href", "#" + picture_id(picture)}}).close();
}

std::string whole(const Picture& picture) {
  return "0 0 " + std::to_string(picture.width) + " " + std::to_string(picture.height);
}

}  // namespace

std::string picture_id(std::size_t picture) { return "picture-" + std::to_string(picture); }

std::string picture_definitions(const Gallery& gallery) {
  if (gallery.pictures.empty()) return "";
  HtmlWriter html;
  html.open("svg", {{"class", "definitions"}, {"width", "0"}, {"height", "0"}, {"aria-hidden", "true"}}).open("defs");
  for (std::size_t i = 0; i < gallery.pictures.size(); ++i)
    html.empty("image", {{"id", picture_id(i)},
                         {"width", std::to_string(gallery.pictures[i].width)},
                         {"height", std::to_string(gallery.pictures[i].height)},
                         {"href", gallery.pictures[i].data_uri}});
  return html.take();
}

void picture(HtmlWriter& html, const Gallery& gallery, const Frame& frame, const std::string& what) {
  html.open("figure", {{"class", "picture"}});
  if (frame.picture)
    picture_figure(html, *frame.picture, whole(gallery.pictures[*frame.picture]));
  else
    html.element("div", {{"class", "nopicture"}}, frame.file.empty() ? "no picture" : "see " + frame.file);
  html.element("figcaption", what).close();
}

void start_picture(HtmlWriter& html, const Gallery& gallery, const TrialPictures& trial, const std::string& what) {
  if (trial.start.picture || !trial.film.picture || trial.film.frames.front().step != 0) {
    picture(html, gallery, trial.start, what);
    return;
  }
  const std::string tile = std::to_string(trial.film.tile);
  html.open("figure", {{"class", "picture"}});
  picture_figure(html, *trial.film.picture, "0 0 " + tile + " " + tile);
  html.element("figcaption", what).close();
}

void film_strip(HtmlWriter& html, const Gallery& gallery, const Film& film, const std::string& what) {
  html.open("div", {{"class", "film"},
                    {"style", "width: min(100%, " + std::to_string(film.tile * film.frames.size()) + "px)"}});
  picture_figure(html, *film.picture, whole(gallery.pictures[*film.picture]), what);
  html.open("div", {{"class", "film-steps"}, {"aria-hidden", "true"}});
  for (const records::FilmFrame& frame : film.frames) html.element("span", std::to_string(frame.step));
  html.close().close();
}

void lens_drawing(HtmlWriter& html, const std::string& scene, const std::string& uri) {
  html.open("figure", {{"class", "plot lens"}});
  html.empty("img", {{"src", uri}, {"alt", "Cross-section of the lens of " + scene + " with rays of several fields"}});
  html.element("figcaption", "Cross-section of the nominal lens with rays of several fields.").close();
}

const TrialPictures* pictures_of(const Gallery& gallery, const Group& group, const std::string& method,
                                 const char* why) {
  for (const TrialPictures& trial : gallery.trials)
    if (trial.why == why && trial.algorithm == method && group.is_of(trial.scene, trial.noise_level, trial.protocol))
      return &trial;
  return nullptr;
}

const Frame* reference_of(const Gallery& gallery, const Group& group) {
  const auto found = gallery.references.find(group.scene);
  return found == gallery.references.end() ? nullptr : &found->second;
}

}  // namespace relign::report
