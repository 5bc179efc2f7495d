/* OpenCV's static library refers to OpenGL, which nothing here uses: without this function it would need libGL and X11.
 */
void (*glXGetProcAddressARB(const unsigned char* name))(void);

void (*glXGetProcAddressARB(const unsigned char* name))(void) {
  (void)name;
  return 0;
}
