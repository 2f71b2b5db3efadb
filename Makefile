# dempm. `make` builds build/dempm; see README.md for the rest. DEPS=no: never install packages.
BUILD ?= build
CC = gcc
CXX = g++
MPICC ?= mpicc
MPICXX ?= mpicxx
WERROR ?=
SANITIZE ?=
OPT ?= -O2 -g
WARN = -Wall -Wextra -Wpedantic -Wshadow -Wstrict-prototypes -Wvla $(WERROR)
CXXWARN = -Wall -Wextra $(WERROR)
# No errno and no traps from arithmetic, and no contraction: the same bits from vector and scalar loops.
NUMERIC = -fno-math-errno -fno-trapping-math -ffp-contract=off
CFLAGS_ALL = -std=c17 $(OPT) $(WARN) $(NUMERIC) -fPIC -fopenmp $(SANITIZE) $(CFLAGS)
