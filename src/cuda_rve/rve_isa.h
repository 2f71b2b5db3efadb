/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Turns the name of an instruction set, -DRVE_ISA=avx2, into what rve_team.h and rve_near.h ask for, and names things
 * after it: RVE_NAME(rve_kernels) is rve_kernels_avx2, RVE_TEXT is "avx2". */
#ifndef DEMPM_RVE_ISA_H
#define DEMPM_RVE_ISA_H

#define RVE_NUMBER_plain 1
#define RVE_NUMBER_avx2 2
#define RVE_NUMBER_avx512 3
#define RVE_NUMBER_avx512_mixed 4
#define RVE_NUMBER_avx512_whole 5
#define RVE_NUMBER_OF(isa) RVE_NUMBER_##isa
#define RVE_NUMBER(isa) RVE_NUMBER_OF(isa)
#if RVE_NUMBER(RVE_ISA) == 1
#define RVE_ISA_PLAIN 1
#elif RVE_NUMBER(RVE_ISA) == 2
#define RVE_ISA_AVX2 1
#elif RVE_NUMBER(RVE_ISA) == 3
#define RVE_ISA_AVX512 1
#elif RVE_NUMBER(RVE_ISA) == 4
#define RVE_ISA_AVX512 1
#define RVE_MIXED 1
#elif RVE_NUMBER(RVE_ISA) == 5
#define RVE_ISA_AVX512 1
#define RVE_WHOLE_REACTIONS 1
#endif

#define RVE_JOIN_OF(name, isa) name##_##isa
#define RVE_JOIN(name, isa) RVE_JOIN_OF(name, isa)
#define RVE_NAME(name) RVE_JOIN(name, RVE_ISA)
#define RVE_QUOTE_OF(isa) #isa
#define RVE_QUOTE(isa) RVE_QUOTE_OF(isa)
#define RVE_TEXT RVE_QUOTE(RVE_ISA)

#endif
