#!/bin/sed -f
# Plain comments as documentation for Doxygen: a comment before a declaration, or after one on its line, documents it.
1s|^/\*|/** \\file\n *|
1s|^// |/// \\file\n/// |
s|^\( *\)// |\1/// |
s|^\( *\)//$|\1///|
s|^\( *\)/\* \([^-]\)|\1/** \2|
s|\([;,{]\) *// |\1 ///< |
s|\([;,]\) */\* \(.*\)|\1 /**< \2|
/^ *\/\/\//s|<\([a-z/]\)|\\<\1|g
