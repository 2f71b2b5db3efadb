# dempm. `make help` lists the targets. Debian packages that are missing get installed; DEPS=no refuses instead.

BUILD ?= build
PREFIX ?= /usr/local
CC = gcc
MPICC ?= mpicc
MPICXX ?= mpicxx
MPIRUN ?= mpirun
PYTHON ?= /usr/bin/python3#        Debian's: another python in PATH would lack Debian's numpy and vtk
NVCC ?= $(firstword $(wildcard $(shell command -v nvcc) /usr/local/cuda/bin/nvcc))
OPT ?= -O3 -g
WERROR ?=#                         -Werror in .ci/run
SANITIZE ?=
DEPS ?= yes
ROUNDS ?= 5#                       of make bench, at most
BENCH_SECONDS ?= 540#              of make bench; three rounds are run in any case

.DEFAULT_GOAL := all
.DELETE_ON_ERROR:
.SUFFIXES:
MAKEFLAGS += --no-builtin-rules
PHONY := all demo test test-unit test-scenes test-gpu test-cuda-host bench bench-gpu bench-peers-native sanitize fuzz run-fuzzers \
         check-cuda install clean help deps programs validate validate-thermal verify verify-full cost coupled-cost coupled-stability \
         compare FORCE

# ---------------------------------------------------------------------------------------------------------------- flags
# psabi: gcc warns of the first vector in a file only; tests/test_vector_abi.py looks at all of them.
# maybe-uninitialized: gcc cannot know that an error status is never BASE_OK and raises false alarms behind TRY(); the
# sanitizers find real ones.
WARN = -Wall -Wextra -Wpedantic -Wshadow -Wvla -Wno-psabi -Wno-maybe-uninitialized $(WERROR)
# No errno and no traps from arithmetic, no contraction: vector and scalar loops then give the same bits.
NUMERIC = -fno-math-errno -fno-trapping-math -ffp-contract=off
COMMON = $(OPT) $(NUMERIC) -fPIC -fopenmp -MMD -MP $(SANITIZE) $(if $(CU_SOURCES),-DDEMPM_CUDA)
C_FLAGS = -std=c17 $(WARN) -Wstrict-prototypes $(COMMON) $(CFLAGS)
# Headers of LIGGGHTS and VTK are not ours: -isystem keeps their warnings out. Found late: `deps` may just have
# installed them.
VTK_INCLUDE = $(shell ls -d /usr/include/vtk-9* 2>/dev/null | head -1)
VTK_SUFFIX = $(patsubst vtk-%,%,$(notdir $(VTK_INCLUDE)))
CXX_FLAGS = -std=c++17 -Wall -Wextra -Wshadow $(WERROR) $(COMMON) -DOMPI_SKIP_MPICXX \
            -isystem /usr/include/liggghts -isystem $(VTK_INCLUDE) $(CXXFLAGS)
VTK_LIBS = $(patsubst %,-lvtk%-$(VTK_SUFFIX),IOXML IOXMLParser IOCore CommonExecutionModel CommonDataModel \
             CommonTransforms CommonMath CommonMisc CommonSystem CommonCore sys)
CUDA_HOME = $(patsubst %/bin/nvcc,%,$(realpath $(NVCC)))
CUDA_LIBS = $(if $(CU_SOURCES),-L$(firstword $(wildcard $(CUDA_HOME)/lib64 $(CUDA_HOME)/targets/*/lib)) \
              -lcudart_static -ldl -lrt -lpthread)
CUDA_ARCHS = $(filter 80 90 100,$(patsubst compute_%,%,$(shell $(NVCC) --list-gpu-arch)))
NVCC_FLAGS = -std=c++17 -O3 -lineinfo --threads 0 $(foreach a,$(CUDA_ARCHS),-gencode arch=compute_$(a),code=sm_$(a)) \
             -gencode arch=compute_$(lastword $(CUDA_ARCHS)),code=compute_$(lastword $(CUDA_ARCHS)) \
             -Xcompiler -fPIC,-fopenmp,-Wall,-Wextra -DDEMPM_CUDA
C_LIBS = $(CUDA_LIBS) $(if $(CU_SOURCES),-lstdc++) -lm
ALL_LIBS = -lliggghts $(VTK_LIBS) $(C_LIBS)

# -------------------------------------------------------------------------------------------------------------- sources
C_SOURCES := $(filter-out %_main.c %/rve_backend_cpu.c,$(wildcard src/base/*.c src/mpm/*.c src/cuda_rve/*.c \
               src/grain_heat/*.c src/grain_bond/*.c))
MPI_SOURCES := $(wildcard src/fix_mpm_couple/*.c)
CXX_SOURCES := $(filter-out %/main.cpp,$(wildcard src/fix_mpm_couple/*.cpp))
CU_SOURCES := $(if $(NVCC),$(wildcard src/cuda_rve/*.cu))
# The RVE kernels once per instruction set, chosen at run time. All lanes run the same code: contraction is safe there. The
# pass that fuses products belongs to -O2; asked for by name, sanitized builds at -O1 round as the others do.
KERNEL_SOURCE := $(wildcard src/cuda_rve/rve_backend_cpu.c)
ISAS := plain $(if $(filter x86_64,$(shell uname -m)),avx2 avx512 avx512_whole avx512_mixed)
FUSE = -ffp-contract=fast -fexpensive-optimizations
ISA_plain = $(FUSE)
ISA_avx2 = $(FUSE) -mavx2 -mfma
# The last two were found by trial on a Zen 4: 3 to 12 % faster than gcc 12's default tuning.
ISA_avx512 = $(FUSE) -mavx512f -mavx512dq -mavx512vl -mavx512bw -mfma -mprefer-vector-width=512 -mtune=skylake-avx512 \
             -fno-tree-pre
ISA_avx512_whole = $(ISA_avx512)
ISA_avx512_mixed = $(ISA_avx512)
# A row of 2D is one long piece of code. On a Zen 4 it is 1.06 times as fast if ordered by the latency of its instructions before registers
# are given out; ordering it again afterwards loses a third of that. Slower in 3D, whose rows are computed in short loops, and on Intel.
ORDER_avx512_2d = -fschedule-insns -fno-schedule-insns2
ORDER_avx512_mixed_2d = $(ORDER_avx512_2d)
KERNELS := $(ISAS:%=%_2d) $(ISAS:%=%_3d)
KERNEL_FLAGS = $(ISA_$(patsubst %_2d,%,$(patsubst %_3d,%,$1))) $(ORDER_$1)
KERNEL_OBJECTS := $(if $(KERNEL_SOURCE),$(KERNELS:%=$(BUILD)/isa/%.o))

LIBRARY := $(BUILD)/libdempm.a
C_OBJECTS := $(C_SOURCES:src/%.c=$(BUILD)/%.o) $(KERNEL_OBJECTS) $(CU_SOURCES:src/%.cu=$(BUILD)/%.cu.o)
MPI_OBJECTS := $(MPI_SOURCES:src/%.c=$(BUILD)/%.o) $(CXX_SOURCES:src/%.cpp=$(BUILD)/%.o)
PROGRAMS := $(if $(wildcard src/fix_mpm_couple/main.cpp),$(BUILD)/dempm) \
            $(if $(wildcard src/cuda_rve/rve_pack_main.c),$(BUILD)/dempm-pack) \
            $(if $(wildcard src/cuda_rve/rve_element_main.c),$(BUILD)/dempm-rve)
TESTS := $(patsubst tests/unit/%.c,$(BUILD)/tests/%,$(wildcard tests/unit/test_*.c)) \
         $(patsubst tests/unit/%.cpp,$(BUILD)/tests/%,$(wildcard tests/unit/test_*.cpp))
BENCHES := $(patsubst tests/bench/%.c,$(BUILD)/bench/%,$(wildcard tests/bench/bench_*.c))
BENCH_OBJECTS := $(ISAS:%=$(BUILD)/bench/isa/%.o)
TOOLS := $(patsubst tests/tools/%.c,$(BUILD)/tools/%,$(wildcard tests/tools/*.c))
FUZZERS := $(patsubst tests/fuzz/%.c,$(BUILD)/fuzz/%,$(wildcard tests/fuzz/fuzz_*.c))

# ------------------------------------------------------------------------------------------------------- compile, link
# One short line per file; V=1 shows the commands.
SHOW = $(if $(V),,@echo "  $(@:$(BUILD)/%=%)";)
all: programs
programs: $(PROGRAMS) $(LIBRARY)

# Objects depend on the packages' stamp by order only, and on a file that changes when the flags do.
READY = $(BUILD)/flags | $(BUILD)/packages
$(BUILD)/flags: FORCE | $(BUILD)/packages
	@mkdir -p $(@D); echo '$(C_FLAGS) | $(foreach k,$(KERNELS),$(call KERNEL_FLAGS,$k)) | $(CXX_FLAGS) | $(NVCC_FLAGS)' > $@.now; \
	 if cmp -s $@ $@.now; then rm $@.now; else mv $@.now $@; fi

$(BUILD)/%.o: src/%.c $(READY)
	@mkdir -p $(@D)
	$(SHOW) $(CC) $(C_FLAGS) -c $< -o $@
$(BUILD)/fix_mpm_couple/%.o: src/fix_mpm_couple/%.c $(READY)
	@mkdir -p $(@D)
	$(SHOW) $(MPICC) $(C_FLAGS) -c $< -o $@
$(BUILD)/fix_mpm_couple/%.o: src/fix_mpm_couple/%.cpp $(READY)
	@mkdir -p $(@D)
	$(SHOW) $(MPICXX) $(CXX_FLAGS) -c $< -o $@
$(BUILD)/isa/%.o: $(KERNEL_SOURCE) $(READY)
	@mkdir -p $(@D)
	$(SHOW) $(CC) $(C_FLAGS) $(call KERNEL_FLAGS,$*) -DRVE_ISA=$(patsubst %_2d,%,$(patsubst %_3d,%,$*)) \
	  -DRVE_DIMENSION=$(if $(filter %_2d,$*),2,3) -c $< -o $@
$(BUILD)/%.cu.o: src/%.cu $(READY)
	@mkdir -p $(@D)
	$(SHOW) $(NVCC) $(NVCC_FLAGS) -MMD -MP -MF $(BUILD)/$*.cu.d -c $< -o $@

$(LIBRARY): $(C_OBJECTS) $(MPI_OBJECTS)
	@rm -f $@
	$(SHOW) ar rcs $@ $^
$(BUILD)/dempm: $(BUILD)/fix_mpm_couple/main.o $(LIBRARY)
	$(SHOW) $(MPICXX) $(SANITIZE) -fopenmp $^ $(ALL_LIBS) -o $@
$(BUILD)/dempm-pack: $(BUILD)/cuda_rve/rve_pack_main.o $(LIBRARY)
	$(SHOW) $(CC) $(SANITIZE) -fopenmp $^ $(C_LIBS) -o $@
$(BUILD)/dempm-rve: $(BUILD)/cuda_rve/rve_element_main.o $(LIBRARY)
	$(SHOW) $(CC) $(SANITIZE) -fopenmp $^ $(C_LIBS) -o $@

# Tests named test_mpi_* need MPI, tests in C++ the VTK library; the others only plain C.
$(BUILD)/tests/test_mpi_%: tests/unit/test_mpi_%.c $(LIBRARY)
	@mkdir -p $(@D)
	$(SHOW) $(MPICC) $(C_FLAGS) -Isrc $< $(LIBRARY) -lcmocka $(C_LIBS) -o $@
$(BUILD)/tests/%: tests/unit/%.c $(LIBRARY)
	@mkdir -p $(@D)
	$(SHOW) $(CC) $(C_FLAGS) -Isrc $< $(LIBRARY) -lcmocka $(C_LIBS) -o $@
$(BUILD)/tests/%: tests/unit/%.cpp $(LIBRARY)
	@mkdir -p $(@D)
	$(SHOW) $(MPICXX) $(CXX_FLAGS) -Isrc $< $(LIBRARY) -lcmocka $(ALL_LIBS) -o $@
$(BUILD)/bench/%: tests/bench/%.c $(BENCH_OBJECTS) $(LIBRARY)
	@mkdir -p $(@D)
	$(SHOW) $(CC) $(C_FLAGS) -Isrc $(filter %.c %.o %.a,$^) $(C_LIBS) -o $@
$(BUILD)/bench/isa/%.o: tests/bench/isa.c $(READY)
	@mkdir -p $(@D)
	$(SHOW) $(CC) $(C_FLAGS) $(call KERNEL_FLAGS,$*_2d) -DRVE_ISA=$* -Isrc -c $< -o $@
.SECONDARY: $(BENCH_OBJECTS)
# The device's source on the host: a fiber for each of its threads, see tests/cuda_host/cuda_runtime.h.
$(BUILD)/cuda_host/device.o: src/cuda_rve/rve_backend_cuda.cu tests/cuda_host/cuda_runtime.h $(READY)
	@mkdir -p $(@D)
	$(SHOW) $(CXX) -x c++ -std=c++17 -Wall -Wextra -Wno-unknown-pragmas $(WERROR) $(OPT) $(FUSE) -fno-extern-tls-init -MMD -MP \
	  -D__CUDACC__ -DDEMPM_CUDA -Itests/cuda_host -c $< -o $@
$(BUILD)/cuda_host/test_mpi_%: tests/unit/test_mpi_%.c $(BUILD)/cuda_host/device.o $(LIBRARY)
	$(SHOW) $(MPICC) $(C_FLAGS) -Isrc $(filter %.c %.o %.a,$^) -lcmocka $(C_LIBS) -lstdc++ -o $@
$(BUILD)/cuda_host/%: tests/unit/%.c $(BUILD)/cuda_host/device.o $(LIBRARY)
	$(SHOW) $(CC) $(C_FLAGS) -Isrc $(filter %.c %.o %.a,$^) -lcmocka $(C_LIBS) -lstdc++ -o $@
$(BUILD)/cuda_host/dempm: $(BUILD)/fix_mpm_couple/main.o $(BUILD)/cuda_host/device.o $(LIBRARY)
	$(SHOW) $(MPICXX) $(SANITIZE) -fopenmp $^ $(ALL_LIBS) -o $@
$(BUILD)/tools/%: tests/tools/%.c $(LIBRARY)
	@mkdir -p $(@D)
	$(SHOW) $(CC) $(C_FLAGS) -Isrc $< $(LIBRARY) $(C_LIBS) -o $@
$(BUILD)/fuzz/%: tests/fuzz/%.c $(LIBRARY)
	@mkdir -p $(@D)
	$(SHOW) $(CC) $(C_FLAGS) -Isrc $< $(LIBRARY) $(C_LIBS) -o $@

-include $(shell test -d $(BUILD) && find $(BUILD) -name '*.d')

# ------------------------------------------------------------------------------------------------------------- running
RUN_ENV = DEMPM_BUILD=$(abspath $(BUILD)) MPIRUN=$(MPIRUN) PYTHON=$(PYTHON)
PYTEST = $(RUN_ENV) $(PYTHON) -m pytest -q -p no:cacheprovider

test: programs $(TESTS) $(TOOLS) $(addprefix $(BUILD)/cuda_host/,test_rve_device test_mpi_device dempm)
	$(PYTEST) tests
test-unit: $(TESTS)
	$(PYTEST) tests/test_unit.py
test-scenes: programs $(TOOLS)
	$(PYTEST) tests --ignore=tests/test_unit.py
test-gpu: $(TESTS)
	$(RUN_ENV) DEMPM_BACKEND=cuda $(PYTHON) -m pytest -q -p no:cacheprovider tests/test_unit.py
HOST_TESTS = $(patsubst tests/unit/%.c,$(BUILD)/cuda_host/%,$(wildcard tests/unit/test_rve_*.c))
test-cuda-host: $(HOST_TESTS)
	$(foreach t,$(HOST_TESTS),DEMPM_BACKEND=cuda $(t) &&) true
SANITIZED = $(MAKE) BUILD=$(BUILD)/sanitize OPT="-O1 -g -fno-omit-frame-pointer" NVCC= \
            SANITIZE="-fsanitize=address,undefined -fno-sanitize-recover=undefined"
sanitize:
	+$(SANITIZED) test-unit
fuzz:
	+$(SANITIZED) run-fuzzers
run-fuzzers: $(FUZZERS)
	$(foreach f,$(FUZZERS),DEMPM_TEST_DATA=tests/data $(f) &&) true
bench: programs $(BENCHES) $(BUILD)/peers
	until=$$(($$(date +%s) + $(BENCH_SECONDS))) && $(BUILD)/bench/bench_rve cpu && \
	OMP_PROC_BIND=true $(BUILD)/bench/bench_mpm cpu $(BUILD)/bench/mpm.json $(ROUNDS) && \
	$(PYTHON) tests/bench/rve.py $(BUILD) --rounds $(ROUNDS) --until $$until
bench-gpu: programs $(BENCHES)
	$(BUILD)/bench/bench_rve cuda
	$(PYTHON) tests/bench/rve.py $(BUILD) --gpu
bench-peers-native: $(BUILD)/peers
	tests/bench/lammps_native $(BUILD)/bench/lammps-native
demo: programs
	$(RUN_ENV) DEMPM=$(abspath $(BUILD)/dempm) DEMPM_PACK=$(abspath $(BUILD)/dempm-pack) examples/column_collapse/run

# Compares with LAMMPS and YADE too where they are installed.
validate: programs $(TOOLS) validate-thermal
	$(foreach s,rve_stability rve_quasi_static rve_against_peers rve_conductivity,$(RUN_ENV) $(PYTHON) tests/validation/$(s).py &&) true
validate-thermal: programs $(BUILD)/tests/test_grain_heat
	$(foreach s,thermal_pairs thermal_liggghts thermal_box,$(RUN_ENV) $(PYTHON) tests/validation/$(s).py &&) true
# The cases of TM-DEMPM; -full: the papers' sizes, hours to days. Finished runs are not repeated.
verify: programs
	$(RUN_ENV) $(PYTHON) tests/verify/verify.py $(CASES)
verify-full: programs
	$(RUN_ENV) $(PYTHON) tests/verify/verify.py --full $(CASES)
cost: programs
	$(RUN_ENV) $(PYTHON) tests/validation/rve_cost_error.py $(if $(QUICK),--quick)
coupled-cost: programs
	$(RUN_ENV) $(PYTHON) tests/verify/coupled_cost.py $(CASES)
coupled-stability: programs $(BUILD)/tools/mpm_stability
	$(RUN_ENV) $(PYTHON) tests/verify/coupled_stability.py

# The multiscale answer against full DEM, for the same scene. Finished runs are not repeated.
compare: programs
	$(RUN_ENV) $(PYTHON) tests/compare/compare.py $(if $(QUICK),--quick) $(CASES)

check-cuda:
ifeq ($(strip $(NVCC)),)
	@echo "check-cuda: nvcc not found (PATH, /usr/local/cuda/bin): the CUDA sources are not compiled"
else
	@mkdir -p $(BUILD)/check-cuda
	$(foreach f,$(CU_SOURCES),$(NVCC) $(NVCC_FLAGS) -Werror all-warnings -c $(f) \
	  -o $(BUILD)/check-cuda/$(notdir $(f)).o &&) true
	@echo "check-cuda: $(words $(CU_SOURCES)) file(s) for $(CUDA_ARCHS:%=sm_%)"
endif

install: programs
	install -d $(DESTDIR)$(PREFIX)/bin $(DESTDIR)$(PREFIX)/share/doc/dempm/doc $(DESTDIR)$(PREFIX)/share/dempm
	install -m 755 $(PROGRAMS) $(DESTDIR)$(PREFIX)/bin
	install -m 644 examples/element_tests/plot.py $(DESTDIR)$(PREFIX)/share/dempm/element_plot.py
	install -m 644 README.md LICENSE CHANGELOG.md $(DESTDIR)$(PREFIX)/share/doc/dempm
	install -m 644 doc/*.md $(DESTDIR)$(PREFIX)/share/doc/dempm/doc
clean:
	rm -rf $(BUILD)

# ------------------------------------------------------------------------------------------------------------ packages
PACKAGES = gcc g++ liggghts libliggghts-dev openmpi-bin libopenmpi-dev libvtk9-dev libcmocka-dev python3 python3-numpy \
           python3-scipy python3-matplotlib python3-vtk9 python3-pytest
PEERS = lammps yade util-linux
deps: $(BUILD)/packages
$(BUILD)/packages $(BUILD)/peers: Makefile
	@mkdir -p $(@D); wanted="$(if $(filter %/peers,$@),$(PEERS),$(PACKAGES))"; \
	command -v dpkg-query >/dev/null || { echo "deps: no dpkg here; taking for granted: $$wanted"; touch $@; exit 0; }; \
	missing=; for p in $$wanted; do \
	  case "$$(dpkg-query -W -f '$${db:Status-Abbrev}' $$p 2>/dev/null)" in ii*) ;; *) missing="$$missing $$p";; esac; done; \
	if [ -n "$$missing" ]; then \
	  if [ "$(DEPS)" = no ]; then echo "deps: DEPS=no, but these packages are missing:$$missing" >&2; exit 1; fi; \
	  sudo=; [ "$$(id -u)" = 0 ] || sudo=sudo; \
	  echo "deps: installing$$missing"; \
	  get="$$sudo env DEBIAN_FRONTEND=noninteractive apt-get -y -q -o DPkg::Lock::Timeout=600"; \
	  { apt-cache show $$missing >/dev/null 2>&1 && $$get install --no-install-recommends $$missing; } || \
	  { $$get update && $$get install --no-install-recommends $$missing; }; \
	fi && touch $@

help:
	@echo "make              build/dempm, build/dempm-pack and build/dempm-rve"
	@echo "make demo         the collapse of a granular column; pictures in examples/column_collapse/out"
	@echo "make test         unit tests and scenes (test-unit, test-scenes: one of them; test-gpu: on a GPU)"
	@echo "make bench        timings, also of LIGGGHTS, LAMMPS and YADE with the same job (bench-gpu: on a GPU; ROUNDS=5 BENCH_SECONDS=540)"
	@echo "make bench-peers-native   LAMMPS compiled for this machine, for make bench to compare with"
	@echo "make sanitize     unit tests under the address and undefined-behaviour sanitizers"
	@echo "make fuzz         mutated packing files under the sanitizers"
	@echo "make validate     the figures of doc/validation.md; also against LAMMPS and YADE where they are installed"
	@echo "make validate-thermal   the part of it about the heat of grains: build/validate/report.json; 4 minutes"
	@echo "make verify       the cases of TM-DEMPM against their references, error beside seconds (verify-full: the papers' sizes; CASES=rod)"
	@echo "make cost         error against cost for sizes, rates, damping of packings (doc/performance.md), 20 minutes; QUICK=1: half a minute"
	@echo "make coupled-cost error against processor time of rod, heated_square and biaxial (doc/verification.md), 12 minutes; CASES=rod"
	@echo "make coupled-stability   time step against PIC fraction, shear to 10, a settled column for a million steps; 6 minutes"
	@echo "make compare      multiscale against full DEM, error beside seconds (doc/comparison.md), an hour and a half of one core; QUICK=1: a minute; CASES=bed"
	@echo "make test-cuda-host   all tests of the packings with the CUDA source on the host, a fiber for each thread; half an hour"
	@echo "make check-cuda   compiles the CUDA sources with warnings as errors, when nvcc is found"
	@echo "make install PREFIX=/usr/local"
	@echo "make deps         installs missing Debian packages (every target does; DEPS=no refuses instead)"
	@echo "make clean        removes build/"
	@echo "Variables: V=1 OPT WERROR SANITIZE CFLAGS CXXFLAGS NVCC (NVCC= builds without CUDA) BUILD PYTHON MPIRUN"

.PHONY: $(PHONY)
