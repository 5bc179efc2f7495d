// Pictures in the page: each is embedded once and shown by reference.
#pragma once

#include <string>

#include "markup/html_writer.h"
#include "report/page_group.h"
#include "report/pictures.h"

namespace relign::report {

std::string picture_id(std::size_t picture);              // id of its definition
std::string picture_definitions(const Gallery& gallery);  // all pictures, for <use> elements

// With caption `what`; the name of the file if it is not embedded.
void picture(HtmlWriter& html, const Gallery& gallery, const Frame& frame, const std::string& what);

// The start of a trial: its picture, or the first tile of its film.
void start_picture(HtmlWriter& html, const Gallery& gallery, const TrialPictures& trial, const std::string& what);

// The whole film in one row.
void film_strip(HtmlWriter& html, const Gallery& gallery, const Film& film, const std::string& what);

// The cross-section of a lens, a data URI.
void lens_drawing(HtmlWriter& html, const std::string& scene, const std::string& uri);

// Pictures of a group's method; nullptr if there are none. `why`: best, median, worst.
const TrialPictures* pictures_of(const Gallery& gallery, const Group& group, const std::string& method,
                                 const char* why);
const Frame* reference_of(const Gallery& gallery, const Group& group);

}  // namespace relign::report
