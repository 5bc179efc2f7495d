// The report: one self-contained HTML file made from a results folder alone. Knows no optics and
// loads no plugin: a report can be made on another machine.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace relign::report {

// Writes curves.csv, curves.json and instances.csv into the results folder (tables of the same data).
void write_tables(const std::filesystem::path& results);

// The page as text. Throws Error for folders that hold no results.
std::string html_report(const std::filesystem::path& results);
void write_html_report(const std::filesystem::path& results, const std::filesystem::path& page);

// Plain-text ranking for the terminal; empty results give a sentence that says so.
std::string ranking_table(const std::filesystem::path& results);

// The ranking as Markdown: a table per scene and protocol with a column per noise level, best method first.
std::string markdown_report(const std::filesystem::path& results);

}  // namespace relign::report
