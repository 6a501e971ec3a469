/* No model is compiled in: it is read from a file. */
#include "model.h"

const uint64_t model_data[] = {0};
const size_t model_data_size = 0;
const Codes *const model_codes = NULL;
