#include "report/assets.h"

RELIGN_EMBEDDED(relign::report::assets, page_html)
RELIGN_EMBEDDED(relign::report::assets, replay_html)
RELIGN_EMBEDDED(relign::report::assets, page_css)
RELIGN_EMBEDDED(relign::report::assets, page_js)
