// The page in a real browser (Debian and Ubuntu: chromium), skipped where there is none.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <regex>
#include <set>

#include "base/files.h"
#include "report/made_pictures.h"
#include "report/made_statistics.h"
#include "report/page.h"
#include "report/report.h"

namespace relign::report {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

struct Seen {
  std::string dom;
  std::string root;     // the start tag of <html>, whose data attributes report the state
  std::string console;  // one line per message: errors and policy violations
};

class Browser : public MadePictures {
 protected:
  void SetUp() override {
    MadePictures::SetUp();
    if (std::system("command -v chromium >/dev/null 2>&1") != 0)
      GTEST_SKIP() << "chromium is not installed: the page was not tested in a browser";
  }

  Seen open(const std::string& page, const std::string& window = "1280,900") {
    write_file_atomically(folder_ / "page.html", page);
    // The proxy does not exist: neither page nor browser can reach a network.
    const std::string command =
        "timeout 60 chromium --headless=new --no-sandbox --disable-gpu --no-first-run "
        "--disable-background-networking --disable-component-update --proxy-server=127.0.0.1:9 "
        "--user-data-dir='" +
        (folder_ / "profile").string() + "' --window-size=" + window +
        " --virtual-time-budget=10000 --enable-logging=stderr --dump-dom 'file://" + (folder_ / "page.html").string() +
        "' >'" + (folder_ / "dom").string() + "' 2>'" + (folder_ / "log").string() + "'";
    EXPECT_EQ(std::system(command.c_str()), 0) << read_file(folder_ / "log");
    Seen seen;
    seen.dom = read_file(folder_ / "dom");
    const std::size_t root = seen.dom.find("<html");
    if (root != std::string::npos) seen.root = seen.dom.substr(root, seen.dom.find("<head", root) - root);
    const std::string log = read_file(folder_ / "log");
    const std::regex message("[^\n]*CONSOLE[^\n]*\n");
    for (std::sregex_iterator it(log.begin(), log.end(), message), end; it != end; ++it) seen.console += it->str();
    return seen;
  }

  // The page with one more script, and without the policy that would block it.
  static std::string acting(std::string page, const std::string& script) {
    page = std::regex_replace(page, std::regex("<meta http-equiv[^>]*>"), "");
    page.insert(page.rfind("</body>"), "<script>{" + script + "}</script>");
    return page;
  }

  static std::size_t count(const std::string& text, const std::string& part) {
    std::size_t found = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
    return found;
  }

  std::vector<records::TrialRecord> two_levels() {
    std::vector<records::TrialRecord> trials;
    for (const char* level : {"rho0", "rho0.5"})
      for (std::uint64_t i = 0; i < 3; ++i) {
        const double more = 0.01 * static_cast<double>(i);
        trials.push_back(trial("slow", i, {0.1 + more, 0.09 + more, 0.08 + more}, level));
        trials.push_back(trial(kHostile, i, {0.1 + more, 0.05 + more, 0.02 + more}, level));
      }
    return trials;
  }
};

TEST_F(Browser, DrawsCurvesWithoutErrorsOrRequests) {
  write(two_levels());
  const Seen seen = open(Report(folder_).html());
  EXPECT_THAT(seen.root, HasSubstr("data-curves=\"2\""));
  EXPECT_GT(count(seen.dom, "<svg class=\"figure\""), 2u) << "the first screen's, too";
  EXPECT_EQ(seen.console, "");
  EXPECT_EQ(count(seen.dom, "<img"), 0u) << "the hostile name is text in legend and charts as well";
  EXPECT_EQ(count(seen.dom, "<input type=\"checkbox\""), 2u) << "two methods";
}

// Proves that the test above can fail.
TEST_F(Browser, PolicyBlocksInjectedMarkup) {
  write(two_levels());
  std::string page = Report(folder_).html();
  page.insert(page.rfind("</body>"),
              "<img src=\"http://127.0.0.1:9/x.png\"><script>document.documentElement.dataset.owned = '1'</script>");
  const Seen seen = open(page);
  EXPECT_THAT(seen.console, HasSubstr("img-src"));
  EXPECT_THAT(seen.console, HasSubstr("script-src"));
  EXPECT_THAT(seen.root, Not(HasSubstr("data-owned")));
}

TEST_F(Browser, TheFirstScreenAnswers) {
  write(two_levels());
  const Seen seen = open(acting(Report(folder_).html(), R"(
      const out = document.documentElement.dataset, by = (id) => document.getElementById(id);
      const bottom = (selector) => document.querySelector(selector).getBoundingClientRect().bottom;
      out.answer = document.querySelector('.headline').textContent.slice(0, 40);
      out.fits = String(bottom('#first-figure') < innerHeight && bottom('.verdicts tbody') < innerHeight);
      out.folded = String([...document.querySelectorAll('.sentences')].every((one) => !one.open));
      const drawn = () => by('first-chart').querySelector('.frame').innerHTML, before = drawn();
      by('first-group').value = '1'; by('first-group').dispatchEvent(new Event('change'));
      out.changes = String(drawn() !== before);)"));
  EXPECT_EQ(seen.console, "");
  EXPECT_THAT(seen.root, HasSubstr("data-answer=\"Lowest median error at both noise levels"));
  EXPECT_THAT(seen.root, HasSubstr("data-fits=\"true\""));
  EXPECT_THAT(seen.root, HasSubstr("data-folded=\"true\""));
  EXPECT_THAT(seen.root, HasSubstr("data-changes=\"true\""));
}

// Under the policy of the page.
TEST_F(Browser, SavesChartsAsSvgAndPng) {
  write(two_levels());
  std::string page = acting(Report(folder_).html(), R"(
      const out = document.documentElement.dataset, saved = [];
      HTMLAnchorElement.prototype.click = function () { saved.push([this.download, decodeURIComponent(this.href)]); };
      const [svg, png] = document.querySelectorAll('.card .save button');
      svg.click(); png.click();
      setTimeout(() => {
        out.names = saved.map(([name]) => name).join();
        out.svg = String(saved[0][1].includes('<svg') && saved[0][1].includes('#0072B2') && !saved[0][1].includes('var('));
        out.png = String(saved[1][1].startsWith('data:image/png') && saved[1][1].length > 5000);
      }, 2000);)");
  page.insert(page.find("<meta name=\"viewport\""),
              "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; style-src "
              "'unsafe-inline'; script-src 'unsafe-inline'\">");
  const Seen seen = open(page);
  EXPECT_EQ(seen.console, "");
  EXPECT_THAT(seen.root, HasSubstr("data-names=\"error-rho0.svg,error-rho0.png\""));
  EXPECT_THAT(seen.root, HasSubstr("data-svg=\"true\""));
  EXPECT_THAT(seen.root, HasSubstr("data-png=\"true\""));
}

TEST_F(Browser, ChartsCanBeReadByKeyboardAndOnAPhone) {
  write(two_levels());
  const Seen seen = open(acting(Report(folder_).html(), R"(
      const out = document.documentElement.dataset, frame = document.querySelector('.card .frame');
      const press = (key) => frame.dispatchEvent(new KeyboardEvent('keydown', {key, bubbles: true, cancelable: true}));
      const words = () => document.querySelector('.card .readout').textContent;
      out.focusable = String(frame.tabIndex === 0);
      press('Home'); const first = words();
      press('ArrowRight'); const second = words();
      press('ArrowDown'); const other = words();
      out.reads = String(new Set([first, second, other]).size === 3 && second.includes('image 1: '));
      out.fits = String(innerWidth < 600 && document.documentElement.scrollWidth <= innerWidth);)"),
                         "390,900");
  EXPECT_EQ(seen.console, "");
  for (const char* what : {"focusable", "reads", "fits"})
    EXPECT_THAT(seen.root, HasSubstr(std::string("data-") + what + "=\"true\"")) << what;
}

TEST_F(Browser, ControlsSortTablesAndChangeCharts) {
  write(two_levels());
  const Seen seen = open(acting(Report(folder_).html(), R"(
      const out = document.documentElement.dataset, by = (id) => document.getElementById(id);
      const change = (element, value) => { element.value = value; element.dispatchEvent(new Event('change')); };
      const frame = document.querySelector('.card .frame'), drawn = () => frame.innerHTML;
      const firsts = () => [...document.querySelectorAll('#ranking tbody')].map((b) => b.rows[1].cells[0].textContent.slice(0, 4)).join();
      out.firstBefore = firsts();
      document.querySelectorAll('#ranking thead button')[1].click();
      document.querySelectorAll('#ranking thead button')[1].click();
      out.firstAfter = firsts();
      change(by('bands'), 'none');
      const all = drawn();
      by('none').click();
      const none = drawn();
      by('all').click();
      out.inkChanges = String(none !== all && drawn() === all);
      const labels = () => [...frame.querySelectorAll('.axis text[text-anchor=end]')].map((l) => l.textContent).join();
      const log = labels();
      change(by('scale'), 'linear');
      out.axisChanges = String(labels() !== log && labels().startsWith('0,'));
      const before = labels();
      change(by('track'), 'measured');
      out.trackChanges = String(labels() !== before);
      document.querySelectorAll('#legend li')[1].dispatchEvent(new Event('mouseenter'));
      out.highlights = String(frame.querySelectorAll('.lit').length === 1 && frame.querySelectorAll('.dim').length === 1);)"));
  EXPECT_EQ(seen.console, "");
  EXPECT_THAT(seen.root, HasSubstr("data-first-before=\"&quot;&gt;&lt;i,&quot;&gt;&lt;i\""));
  EXPECT_THAT(seen.root, HasSubstr("data-first-after=\"slow,slow\"")) << "descending by error";
  EXPECT_THAT(seen.root, HasSubstr("data-ink-changes=\"true\""));
  EXPECT_THAT(seen.root, HasSubstr("data-axis-changes=\"true\""));
  EXPECT_THAT(seen.root, HasSubstr("data-track-changes=\"true\""));
  EXPECT_THAT(seen.root, HasSubstr("data-highlights=\"true\""));
}

// The clicks are a script's, the tables and colours change by style rules alone.
TEST_F(Browser, TheMatrixSwitchesTablesAndColours) {
  std::vector<records::TrialRecord> trials;
  for (const char* level : {"rho0", "rho0.5"})
    for (const char* method : {"fine", kHostile.c_str()}) {
      trials.push_back(trial(method, 0, {0.1, 0.05, 0.05, 0.05, 0.05, 0.05, 0.05, 0.003}, level));
      trials.back().own_optimum.mse = 0;
    }
  write(trials);
  const Seen seen = open(acting(Report(folder_).html(), R"(
      const out = document.documentElement.dataset;
      const style = (element) => getComputedStyle(element);
      const shown = () => [...document.querySelectorAll('.matrix .view')].filter((v) => style(v).display !== 'none').map((v) => v.className.slice(-3)).join();
      const colour = () => style([...document.querySelectorAll('.matrix .view')].find((v) => style(v).display !== 'none').querySelector('td[title]')).backgroundColor;
      const click = (id) => document.querySelector(`label[for=${id}]`).click();
      out.first = shown();
      const error = colour();
      click('choice-u1');
      out.colourChanges = String(error !== colour());
      click('choice-r2');
      out.second = shown();
      click('choice-i0');
      out.third = shown();)"));
  EXPECT_EQ(seen.console, "");
  EXPECT_THAT(seen.root, HasSubstr("data-first=\"v10\"")) << "the last image by the rule of the page";
  EXPECT_THAT(seen.root, HasSubstr("data-colour-changes=\"true\""));
  EXPECT_THAT(seen.root, HasSubstr("data-second=\"v12\""));
  EXPECT_THAT(seen.root, HasSubstr("data-third=\"v02\""));
}

TEST_F(Browser, ShowsClocksBandsAndLabels) {
  write(two_levels());
  const std::string html = page_html(with_statistics(page_model(load_results(folder_))), load_gallery(folder_), {});
  const Seen seen = open(acting(html, R"(
      const out = document.documentElement.dataset, by = (id) => document.getElementById(id);
      const change = (element, value) => { element.value = value; element.dispatchEvent(new Event('change')); };
      const frame = document.querySelector('.card .frame');
      const looks = [frame.innerHTML];
      const labels = () => [...frame.querySelectorAll('.axis text[text-anchor=middle]')].map((l) => l.textContent).filter((text) => text > '' && !isNaN(text)).join();
      out.ends = [...frame.querySelectorAll('svg.figure > g[class^=s] text')].map((end) => end.textContent.slice(0, 4)).sort().join();
      out.bands = [...by('bands').options].map((o) => o.value).join();
      out.clocks = [...by('clock').options].map((o) => o.value).join();
      change(by('bands'), 'quartiles'); looks.push(frame.innerHTML);
      change(by('bands'), 'none'); looks.push(frame.innerHTML);
      change(by('clock'), 'machine_seconds'); looks.push(frame.innerHTML);
      change(by('clock'), 'step'); change(by('xscale'), 'log'); looks.push(frame.innerHTML);
      out.logSteps = labels();
      change(by('xscale'), 'linear');
      out.looks = String(new Set(looks).size);
      const box = frame.getBoundingClientRect(), y = box.top + 60;
      const fire = (element, type, x) => element.dispatchEvent(new PointerEvent(type, {bubbles: true, cancelable: true, pointerType: 'mouse', clientX: x, clientY: y}));
      const before = labels();
      fire(frame, 'pointerdown', box.left + 100); fire(frame, 'pointermove', box.left + 260); fire(window, 'pointerup', box.left + 260);
      out.zooms = String(labels() !== before);
      frame.dispatchEvent(new MouseEvent('dblclick', {bubbles: true}));
      out.resets = String(labels() === before);
      const head = document.querySelectorAll('.pairs thead button')[0];
      head.click(); out.pairsSort = head.parentElement.getAttribute('aria-sort');)"));
  EXPECT_EQ(seen.console, "");
  EXPECT_THAT(seen.root, HasSubstr("data-ends=\"&quot;&gt;&lt;i,slow\""));
  EXPECT_THAT(seen.root, HasSubstr("data-bands=\"interval,quartiles,none\""));
  EXPECT_THAT(seen.root, HasSubstr("data-clocks=\"step,machine_seconds,algorithm_seconds\""));
  EXPECT_THAT(seen.root, HasSubstr("data-looks=\"5\""));
  EXPECT_THAT(seen.root, HasSubstr("data-zooms=\"true\""));
  EXPECT_THAT(seen.root, HasSubstr("data-resets=\"true\""));
  EXPECT_THAT(seen.root, HasSubstr("data-log-steps=\"1,2\""));
  EXPECT_THAT(seen.root, HasSubstr("data-pairs-sort=\"ascending\""));
  EXPECT_EQ(count(seen.dom, "<img"), 0u);
}

TEST_F(Browser, ReplaySelectsStepsAndPlays) {
  write(two_levels());
  put("film.webp", made_film());
  put("other.webp", made_lossy_film());
  put("end.png", made_png());
  write_index({with_film(entry("slow", "median", "", "end.png"), "film.webp"),
               with_film(entry(kHostile, "worst", "", "end.png"), "other.webp")},
              {{{"scene", "relign_od"}, {"file", "end.png"}}});
  Gallery gallery = load_gallery(folder_);
  gallery.axes["relign_od"] = {{kHostile, "mm", -1, 1}};
  const std::string html = page_html(page_model(load_results(folder_)), gallery, {});
  EXPECT_EQ(open(html).console, "");
  const Seen seen = open(acting(html, R"(
      const out = document.documentElement.dataset, by = (id) => document.getElementById(id);
      const key = (name) => by('replay-slider').dispatchEvent(new KeyboardEvent('keydown', {key: name, bubbles: true, cancelable: true}));
      const view = () => by('replay-picture').getAttribute('viewBox'), words = () => by('replay-caption').textContent;
      out.open = String(!by('replay-viewer').hidden && !document.querySelector('.film-strips').open);
      out.tiles = [...by('replay-strip').children].map((tile) => tile.textContent).join();
      out.first = view() + ';' + words();
      key('ArrowRight'); out.second = view() + ';' + words();
      out.pose = by('replay-facts').querySelectorAll('table')[1].rows[1].cells[1].textContent;
      by('replay-slider').value = 2; by('replay-slider').dispatchEvent(new Event('input')); out.third = view();
      by('replay-strip').children[3].click(); out.final = words();
      key('End'); out.last = words();
      by('replay-method').value = 'slow'; by('replay-method').dispatchEvent(new Event('change'));
      out.why = by('replay-why').value;
      key('Home'); by('replay-play').click(); out.playing = by('replay-play').textContent;
      setTimeout(() => { out.played = words() + ';' + by('replay-play').textContent; }, 6000);)"));
  EXPECT_EQ(seen.console, "");
  EXPECT_THAT(seen.root, HasSubstr("data-open=\"true\""));
  EXPECT_THAT(seen.root, HasSubstr("data-tiles=\"0,1,9,final,reference\""));
  EXPECT_THAT(seen.root, HasSubstr("data-first=\"0 0 2 2;image 0\""));
  EXPECT_THAT(seen.root, HasSubstr("data-second=\"2 0 2 2;image 1\""));
  EXPECT_THAT(seen.root, HasSubstr("data-pose=\"-0.800 mm\"")) << "0.1 of the way from -1 to 1";
  EXPECT_THAT(seen.root, HasSubstr("data-third=\"4 0 2 2\""));
  EXPECT_THAT(seen.root, HasSubstr("data-final=\"at the recommended pose, after image 9\""));
  EXPECT_THAT(seen.root, HasSubstr("data-last=\"the reference\""));
  EXPECT_THAT(seen.root, HasSubstr("data-why=\"median\""));
  EXPECT_THAT(seen.root, HasSubstr("data-playing=\"Pause\""));
  EXPECT_THAT(seen.root, HasSubstr("data-played=\"the reference;Play\""));
  EXPECT_EQ(count(seen.dom, "<img"), 0u);
}

TEST_F(Browser, DrawsManyMethodsAndNone) {
  std::vector<records::TrialRecord> trials;
  for (int method = 0; method < 40; ++method)
    trials.push_back(trial("method-" + std::to_string(method), 0, {0.1, 0.1 / (method + 2)}));
  write(trials);
  Seen seen = open(Report(folder_).html());
  EXPECT_THAT(seen.root, HasSubstr("data-curves=\"1\""));
  EXPECT_EQ(seen.console, "");
  // All forty differ in colour or dash.
  std::set<std::string> swatches;
  const std::regex line("<svg class=\"[^\"]*\" width=\"30\"[^>]*><line[^>]*>");
  for (std::sregex_iterator it(seen.dom.begin(), seen.dom.end(), line), end; it != end; ++it)
    swatches.insert(it->str());
  EXPECT_EQ(swatches.size(), 40u);

  fs::remove_all(folder_);
  records::TrialRecord failed = trial("broken", 0, {0.1});
  failed.end = "failed";
  write({failed});
  seen = open(Report(folder_).html());
  EXPECT_THAT(seen.root, HasSubstr("data-curves=\"0\""));
  EXPECT_GT(count(seen.dom, ">No trial finished"), 0u);
  EXPECT_EQ(seen.console, "");
}

TEST_F(Browser, DrawsManyChartsWhenNearTheViewport) {
  std::vector<records::TrialRecord> trials;
  for (int level = 0; level < 30; ++level)
    trials.push_back(trial("a", 0, {0.1, 0.05}, "level" + std::to_string(level)));
  write(trials);
  // The event is dispatched explicitly: a headless browser may end without drawing a frame, which would fire it.
  const Seen seen = open(acting(Report(folder_).html(), R"(
      const out = document.documentElement.dataset, drawn = () => document.querySelectorAll('.card .frame').length;
      out.before = drawn();
      window.scrollTo(0, document.body.scrollHeight);
      window.dispatchEvent(new Event('scroll'));
      out.after = drawn();)"));
  const auto number = [&](const std::string& name) {
    std::smatch found;
    return std::regex_search(seen.root, found, std::regex(name + "=\"(\\d+)\"")) ? std::stoi(found[1]) : -1;
  };
  EXPECT_GE(number("data-before"), 0);
  EXPECT_GT(number("data-after"), number("data-before"));
  EXPECT_LT(number("data-after"), 30);
  EXPECT_EQ(number("data-curves"), number("data-after"));
  EXPECT_EQ(seen.console, "");
}

TEST_F(Browser, PrintOpensDetailsAndRestoresThem) {
  write(two_levels());
  const Seen seen = open(acting(Report(folder_).html(), R"(
      const out = document.documentElement.dataset, folded = () => document.querySelectorAll('details:not([open])').length;
      const mattering = () => document.querySelectorAll('details:not([open]):not(.gallery)').length;
      out.before = mattering();
      out.all = folded();
      window.dispatchEvent(new Event('beforeprint'));
      out.printed = mattering();
      window.dispatchEvent(new Event('afterprint'));
      out.restored = folded() === Number(out.all);)"));
  EXPECT_THAT(seen.root, Not(HasSubstr("data-before=\"0\""))) << "otherwise the test is vacuous";
  EXPECT_THAT(seen.root, HasSubstr("data-printed=\"0\""));
  EXPECT_THAT(seen.root, HasSubstr("data-restored=\"true\""));
  EXPECT_EQ(seen.console, "");
}

}  // namespace
}  // namespace relign::report
