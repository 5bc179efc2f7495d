// Pictures inside the page, by reference: each is embedded once and shown wherever it is wanted.
#pragma once

#include <string>

#include "markup/html_writer.h"
#include "report/pictures.h"

namespace relign::report {

std::string picture_id(std::size_t picture);              // of its definition
std::string picture_definitions(const Gallery& gallery);  // each picture once, for the <use> elements

// With `what` below it; where it is not embedded, the name of its file.
void picture(HtmlWriter& html, const Gallery& gallery, const Frame& frame, const std::string& what);

// A trial's start: its own picture, or the first tile of the trial's film.
void start_picture(HtmlWriter& html, const Gallery& gallery, const TrialPictures& trial, const std::string& what);

// The whole film in one row.
void film_strip(HtmlWriter& html, const Gallery& gallery, const Film& film, const std::string& what);

// What the gallery has of a group's method; nullptr where it has nothing. `why`: best, median, worst.
const TrialPictures* pictures_of(const Gallery& gallery, const Json& group, const std::string& method, const char* why);
const Frame* reference_of(const Gallery& gallery, const Json& group);

}  // namespace relign::report
