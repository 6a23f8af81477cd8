// Just enough of a Cortex-M board (qemu's mps2-an386 and mps2-an500) to run main(): vectors, the floating-point unit,
// and a console by semihosting.
#include <stdint.h>

extern uint32_t stack_end, data_from, data_begin, data_end, bss_begin, bss_end;
int main(void);

static int semihosting(int operation, const void* argument) {
  register int r0 __asm__("r0") = operation;
  register const void* r1 __asm__("r1") = argument;
  __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

void print(const char* text) { semihosting(0x04, text); }

static void leave(int failed) {
  // SYS_EXIT: ADP_Stopped_ApplicationExit, or ADP_Stopped_RunTimeErrorUnknown.
  semihosting(0x18, (const void*)(failed ? 0x20023u : 0x20026u));
  for (;;) {
  }
}

void begin(void) {
  *(volatile uint32_t*)0xE000ED88 |= 0xFu << 20;  // CPACR: the floating-point unit
  __asm__ volatile("dsb\n isb");
  for (uint32_t *to = &data_begin, *from = &data_from; to != &data_end;) *to++ = *from++;
  for (uint32_t* to = &bss_begin; to != &bss_end;) *to++ = 0;
  leave(main());
}

static void fault(void) {
  print("fault\n");
  leave(1);
}

__attribute__((section(".vectors"), used)) static const void* const vectors[16] = {
    &stack_end,         (const void*)begin, (const void*)fault, (const void*)fault,
    (const void*)fault, (const void*)fault, (const void*)fault};
