/* PoCL 5.0 and later compile kernels with barriers rightly or wrongly by chance (drivers.md). This
   program compiles gradient_orbit, whose groups of 16 work-items sum in local memory, again and
   again with an empty cache, and compares its sums with those of single work-items, which need no
   barrier.

     cc -O1 pocl_barriers.c -o pocl_barriers -lOpenCL -lm
     ./pocl_barriers ../../kernels 30
     setarch -R ./pocl_barriers ../../kernels 30           # the compiler's memory lies at the same
   addresses each time

   No compilation is wrong where no address is used twice:

     echo 'void free(void* p) { (void)p; }' | cc -shared -fPIC -fno-builtin -x c - -o never.so
     LD_PRELOAD=./never.so ./pocl_barriers ../../kernels 30 */

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

enum {
  kFactors = 13,
  kSamples = 160,
  kGroup = 16,
  kPadded = 16,
  kSums = 5 * kPadded + 1,
  kColumns = 5 * kPadded + 16
};

/* qj_energy_arguments of kernels/layout/loss.h */
typedef struct {
  double alpha;
  int loss, stride, vectors, items, factors, iterations;
} Arguments;

static double map[16 + 5 * kPadded], samples[7 * kSamples];

static double between(double least, double most) {
  return least + (most - least) * rand() / RAND_MAX;
}

static void fill(void) {
  srand(3);
  map[2] = map[3] = map[5] = .5, map[4] = -.5; /* a turn */
  map[6] = log(20), map[7] = -1e30, map[8] = 1e30;
  map[10] = map[11] = map[13] = map[15] = 16 + 5 * kPadded;
  for (int k = 0; k < kFactors; ++k) {
    map[16 + k] = between(.1, .6);
    for (int j = 1; j < 5; ++j) map[16 + kPadded * j + k] = between(-1, 1);
  }
  for (int i = 0; i < kSamples; ++i) {
    for (int j = 0; j < 3; ++j) samples[j * kSamples + i] = between(-1, 1);
    samples[3 * kSamples + i] = i % 4 ? 0 : .01 * i - .7;
    samples[4 * kSamples + i] = between(.5, 1);
    samples[5 * kSamples + i] = between(-.1, .1);
    samples[6 * kSamples + i] = i % 2 ? 1 : -1;
  }
}

static void check(cl_int status, const char* what) {
  if (status == CL_SUCCESS) return;
  fprintf(stderr, "%s: error %d\n", what, status);
  exit(2);
}

static cl_mem buffer(cl_context context, size_t count, const double* from) {
  double* values = calloc(count, sizeof(double));
  if (from) memcpy(values, from, count * sizeof(double));
  cl_int status;
  const cl_mem made =
      clCreateBuffer(context, CL_MEM_COPY_HOST_PTR, count * sizeof(double), values, &status);
  check(status, "clCreateBuffer");
  free(values);
  return made;
}

/* The gradient by exponents, centres and scale, of two iterates. */
static void gradient(cl_context context, cl_device_id device, const char* kernels, int group,
                     double* sums) {
  const char* source = "#include \"gradient_orbit.cl\"\n";
  char options[1000];
  snprintf(options, sizeof options, "-cl-std=CL1.2 -I %s -DQJ_WIDTH=1 -DQJ_DOUBLE=1 -DQJ_GROUP=%d",
           kernels, group);
  cl_int status;
  const cl_program program = clCreateProgramWithSource(context, 1, &source, NULL, &status);
  check(clBuildProgram(program, 1, &device, options, NULL, NULL), "clBuildProgram");
  const cl_kernel kernel = clCreateKernel(program, "gradient_orbit", &status);
  check(status, "clCreateKernel");
  Arguments with = {1.3, 0, kSamples, 2, 0, kFactors, 2};
  const int rows = with.items = (kSamples + 2 * group - 1) / (2 * group);
  check(clSetKernelArg(kernel, 0, sizeof with, &with), "arguments");
  const cl_mem buffers[] = {buffer(context, 7 * kSamples, samples),
                            buffer(context, 16 + 5 * kPadded, map),
                            buffer(context, (size_t)rows * group * 10, NULL),
                            buffer(context, rows * 5 * kPadded, NULL),
                            buffer(context, rows, NULL),
                            buffer(context, rows * kColumns, NULL)};
  for (int i = 0; i < 6; ++i)
    check(clSetKernelArg(kernel, i + 1, sizeof(cl_mem), &buffers[i]), "buffers");
  const cl_command_queue queue = clCreateCommandQueue(context, device, 0, &status);
  const size_t local = group, global = (size_t)rows * group;
  check(clEnqueueNDRangeKernel(queue, kernel, 1, NULL, &global, &local, 0, NULL, NULL), "launch");
  double* row = malloc(rows * kColumns * sizeof(double));
  check(clEnqueueReadBuffer(queue, buffers[5], 1, 0, rows * kColumns * sizeof(double), row, 0, NULL,
                            NULL),
        "read");
  for (int i = 0; i < kSums; ++i) {
    sums[i] = 0;
    for (int r = 0; r < rows; ++r) sums[i] += row[r * kColumns + i];
  }
}

/* Whether the sums of a compilation are wrong. */
static int is_wrong(const char* kernels) {
  cl_platform_id platform;
  cl_device_id device;
  check(clGetPlatformIDs(1, &platform, NULL), "clGetPlatformIDs");
  check(clGetDeviceIDs(platform, CL_DEVICE_TYPE_CPU, 1, &device, NULL), "clGetDeviceIDs");
  cl_int status;
  const cl_context context = clCreateContext(NULL, 1, &device, NULL, NULL, &status);
  check(status, "clCreateContext");
  double expected[kSums], found[kSums], difference = 0, size = 0;
  gradient(context, device, kernels, 1, expected);
  gradient(context, device, kernels, kGroup, found);
  for (int i = 0; i < kSums; ++i) {
    difference = fmax(difference, fabs(found[i] - expected[i]));
    size = fmax(size, fabs(expected[i]));
  }
  if (difference < 1e-10 * size) return 0;
  printf("wrong by %g of %g\n", difference, size);
  return 1;
}

int main(int count, char** words) {
  if (count != 3) return fprintf(stderr, "usage: pocl_barriers KERNELS COMPILATIONS\n"), 2;
  const int compilations = atoi(words[2]);
  fill();
  int wrong = 0;
  for (int i = 0; i < compilations; ++i) {
    char folder[] = "/tmp/pocl_barriers.XXXXXX";
    if (!mkdtemp(folder)) return perror(folder), 2;
    setenv("POCL_CACHE_DIR", folder, 1);
    fflush(stdout);
    const pid_t child = fork();
    if (child == 0) exit(is_wrong(words[1]));
    int status;
    waitpid(child, &status, 0);
    char removal[100];
    snprintf(removal, sizeof removal, "rm -r %s", folder);
    if (system(removal) != 0 || !WIFEXITED(status) || WEXITSTATUS(status) > 1) return 2;
    wrong += WEXITSTATUS(status);
  }
  printf("%d of %d compilations wrong\n", wrong, compilations);
  return wrong > 0;
}
