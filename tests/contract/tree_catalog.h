// A catalogue of the built plugins of the tree and the compass search.
#pragma once

#include "plugin_host/catalog.h"

namespace relign::test {

inline plugin_host::Catalog& tree_catalog() {
  static plugin_host::Catalog* catalog = [] {
    auto* fresh = new plugin_host::Catalog;  // never destroyed
    fresh->scan(RELIGN_PLUGIN_DIR);
    fresh->add(RELIGN_COMPASS_FOLDER);
    return fresh;
  }();
  return *catalog;
}

}  // namespace relign::test
