# cmake -D INPUT=file -D OUTPUT=file.c -D SYMBOL=name -P embed_file.cmake
# Writes a C source with the input's bytes as `const unsigned char name[]` and their count `name_size`.
file(READ "${INPUT}" hex HEX)
string(LENGTH "${hex}" digits)
math(EXPR size "${digits} / 2")
string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${hex}")
# Lines of readable length: compilers and editors choke on one line of a megabyte.
string(REGEX REPLACE "(................................................................................)" "\\1\n"
       bytes "${bytes}")
get_filename_component(name "${INPUT}" NAME)
file(WRITE "${OUTPUT}" "/* Generated from ${name}. */
extern const unsigned char ${SYMBOL}[];
extern const unsigned long ${SYMBOL}_size;
const unsigned char ${SYMBOL}[] = {\n${bytes}0};
const unsigned long ${SYMBOL}_size = ${size};
")
