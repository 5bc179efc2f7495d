/* The functions of JBIG-KIT that libtiff refers to, which always fail. The wheel has them in the place of Debian's
 * libjbig, which is under the GPL. libtiff allocates the structures, and nothing here reads them.
 */
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>

enum { unsupported = 1 };

/* Decoding: libtiff stops at the status of jbg_dec_in and reports the text of jbg_strerror. */
void jbg_dec_init(void* decoder) { (void)decoder; }

int jbg_newlen(unsigned char* data, size_t length) {
  (void)data, (void)length;
  return unsupported;
}

int jbg_dec_in(void* decoder, unsigned char* data, size_t length, size_t* used) {
  (void)decoder, (void)data, (void)length;
  if (used) *used = 0;
  return unsupported;
}

const char* jbg_strerror(int status) {
  (void)status;
  return "JBIG compression is not supported by this build of libtiff";
}

unsigned long jbg_dec_getsize(const void* decoder) {
  (void)decoder;
  return 0;
}

unsigned char* jbg_dec_getimage(const void* decoder, int plane) {
  (void)decoder, (void)plane;
  return NULL;
}

void jbg_dec_free(void* decoder) { (void)decoder; }

/* Encoding has no status to return: an image without data must not pass for one. Nothing here writes JBIG. */
void jbg_enc_init(void* encoder, unsigned long width, unsigned long height, int planes, unsigned char** data,
                  void (*output)(unsigned char* start, size_t length, void* file), void* file) {
  (void)encoder, (void)width, (void)height, (void)planes, (void)data, (void)output, (void)file;
  fprintf(stderr, "libtiff: %s\n", jbg_strerror(unsupported));
  abort();
}

void jbg_enc_out(void* encoder) { (void)encoder; }

void jbg_enc_free(void* encoder) { (void)encoder; }
