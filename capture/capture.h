// capture/capture.h -- all of capture: from a folder of photos to a Capture and its files.
#pragma once
#include "capture/ingest.h"
#include "capture/photo.h"
#include "capture/sfm_images.h"
#include "capture/store.h"
