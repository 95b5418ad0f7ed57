#!/bin/sh
# GNU parallel: 16 shares, as many at a time as there are processors; with --sshlogin file over several machines that see the folder
# under the same path. What --retries starts again goes on with the rest.
set -u

parallel --retries 5 --line-buffer \
  'truegrind compensate programs --model arm.toml -o corrected --threads 1 --resume --shard {}/16 || [ $? -eq 1 ]' ::: $(seq 16)

truegrind gather corrected --csv corrected.csv --html corrected.html
