#!/bin/sh
# Stands in for `colmap` in tests; fake_colmap.h says what the files in $FAKE_COLMAP mean.
here=$FAKE_COLMAP
if [ -f "$here/broken" ]; then exit 3; fi
if [ "$1" = help ]; then
  echo "COLMAP 3.8 (a fake one)"
  if [ -f "$here/cuda" ]; then echo "(Commit 0 on never with CUDA)"; fi
  exit 0
fi
if [ "$2" = -h ]; then sed 's/.*/  & arg (=0)/' "$here/options"; exit 0; fi
command=$1
echo "$*" >> "$here/calls"
while [ $# -gt 1 ]; do
  case $1 in
    --database_path) database=$2 ;;
    --output_path) output=$2 ;;
    --input_path) input=$2 ;;
    --image_list_path) list=$2 ;;
    --image_path) images=$2 ;;
    --workspace_path) workspace=$2 ;;
  esac
  shift
done
if [ -f "$here/fail.$command" ]; then . "$here/fail.$command"; fi
case $command in
  feature_extractor)
    cp "$here/database" "$database"
    while read -r name; do
      [ -e "$images/$name" ] || { echo "ERROR: no $images/$name"; exit 1; }
      echo "Processed file [1/1]"
    done < "$list" ;;
  exhaustive_matcher)
    echo "Matching block [1/2, 1/1] in 0.1s"
    echo "Matching block [2/2, 1/1] in 0.1s" ;;
  mapper)
    echo "Registering image #2 (2)"
    echo "Registering image #1 (3)"
    for model in "$here"/model.*; do
      if [ -d "$model" ]; then cp -r "$model" "$output/${model##*.}"; fi
    done ;;
  patch_match_stereo)
    cp "$here"/maps/* "$workspace/stereo/depth_maps" ;;
  point_triangulator | image_registrator)
    if [ -d "$here/output" ]; then input=$here/output; fi
    cp "$input"/* "$output" ;;
esac
exit 0
