#!/bin/bash
# The TX40 fit beside Pinocchio's Python regressor with numpy, in one run: same numbers, both times.
#   benches/pinocchio/run.sh [FOLDER]     (FOLDER: where the virtual environment is kept)
# Needs python3 with venv and the packages pin, numpy and scipy from the package index; with g++ and
# Eigen's headers Pinocchio's C++ regressor is timed too. Writes docs/results/pinocchio.json.
set -euo pipefail
cd "$(dirname "$0")/../.."
folder=${1:-target/pinocchio}
data=../shared/data/tx40
if [ ! -d "$data" ]; then
  echo "benches/pinocchio/run.sh: SKIPPED, $data is not there (docs/results/measured/data.md says where it is from)"
  exit 0
fi
mkdir -p "$folder"
if [ ! -x "$folder/venv/bin/python" ]; then
  python3 -m venv "$folder/venv"
  "$folder/venv/bin/pip" install --quiet pin numpy scipy
fi
python=$folder/venv/bin/python
prefix=$("$python" -c 'import os, pinocchio; print(os.path.realpath(os.path.dirname(pinocchio.__file__) + "/../../../.."))')
cpp=()
if g++ -std=c++20 -O3 -DNDEBUG -DBOOST_MPL_LIMIT_LIST_SIZE=30 \
  -DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS -DBOOST_FUSION_INVOKE_MAX_ARITY=10 -DFUSION_MAX_VECTOR_SIZE=10 \
  -I"$prefix/include" -I/usr/include/eigen3 \
  benches/pinocchio/regressor.cpp -o "$folder/regressor" -L"$prefix/lib" \
  -lpinocchio_default -Wl,-rpath,"$prefix/lib" -Wl,--allow-shlib-undefined; then
  cpp=("$folder/regressor")
else
  echo "benches/pinocchio/run.sh: Pinocchio's C++ regressor is not timed: it could not be compiled" >&2
fi
cargo build --locked --release --quiet
cargo bench --locked --quiet --bench pipeline -- "regressor of six joints"
build=${CARGO_TARGET_DIR:-target}
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
"$python" benches/pinocchio/compare.py "$data" "$build" docs/results/pinocchio.json "${cpp[@]}"
