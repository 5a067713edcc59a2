/* Modal equations as a unit of FMI 2.0, Model Exchange. Variables by their value references: inputs
 * direct and parametric, then q (m), v (m/s) and their derivatives. Tables are in modal.h. */
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include "modal.h"

#define STATES (2 * MODES)
#define FIRST 2 /* state among the variables */
#define API __attribute__((visibility("default")))

typedef int Status; /* as fmi2Status */
enum { OK = 0, FAILED = 3 };
typedef const char *String;
typedef unsigned int Reference;

typedef struct {
  double input[FIRST];
  double state[STATES];
} Instance;

typedef struct {
  int newDiscreteStatesNeeded, terminateSimulation, nominalsChanged, valuesChanged, nextTimeDefined;
  double nextTime;
} EventInfo;

/* d state / dt */
static void slopes(const Instance *now, double *out) {
  double x[STATES];
  for (int r = 0; r < MODES; r++) {
    x[r] = now->state[r] / AMPLITUDE;
    x[MODES + r] = now->state[MODES + r] / (AMPLITUDE * FREQUENCY);
  }
  for (int r = 0; r < MODES; r++) {
    double sum = now->input[0] * force[r];
    for (int s = 0; s < MODES; s++) sum += now->input[1] * parametric[r][s] * x[s];
    for (int t = 0; t < COUNT1; t++) sum += coefficient1[t][r] * x[index1[t][0]];
    for (int t = 0; t < COUNT2; t++) sum += coefficient2[t][r] * x[index2[t][0]] * x[index2[t][1]];
    for (int t = 0; t < COUNT3; t++)
      sum += coefficient3[t][r] * x[index3[t][0]] * x[index3[t][1]] * x[index3[t][2]];
    out[r] = now->state[MODES + r];
    out[MODES + r] = sum * AMPLITUDE * FREQUENCY * FREQUENCY;
  }
}

API String fmi2GetTypesPlatform(void) { return "default"; }
API String fmi2GetVersion(void) { return "2.0"; }
API Status fmi2SetDebugLogging(void *i, int on, size_t n, const String *categories) { return OK; }

API void *fmi2Instantiate(String name, int type, String guid, String resources, const void *callbacks,
                          int visible, int logging) {
  return type == 0 && !strcmp(guid, GUID) ? calloc(1, sizeof(Instance)) : NULL;
}
API void fmi2FreeInstance(void *i) { free(i); }

API Status fmi2SetupExperiment(void *i, int given, double tolerance, double start, int stops, double stop) {
  return OK;
}
API Status fmi2EnterInitializationMode(void *i) { return OK; }
API Status fmi2ExitInitializationMode(void *i) { return OK; }
API Status fmi2Terminate(void *i) { return OK; }
API Status fmi2Reset(void *i) {
  memset(i, 0, sizeof(Instance));
  return OK;
}

API Status fmi2GetReal(void *i, const Reference *wanted, size_t n, double *value) {
  const Instance *now = i;
  double slope[STATES];
  slopes(now, slope);
  for (size_t k = 0; k < n; k++) {
    Reference v = wanted[k];
    if (v < FIRST) value[k] = now->input[v];
    else if (v < FIRST + STATES) value[k] = now->state[v - FIRST];
    else if (v < FIRST + 2 * STATES) value[k] = slope[v - FIRST - STATES];
    else return FAILED;
  }
  return OK;
}
API Status fmi2SetReal(void *i, const Reference *given, size_t n, const double *value) {
  Instance *now = i;
  for (size_t k = 0; k < n; k++) {
    Reference v = given[k];
    if (v < FIRST) now->input[v] = value[k];
    else if (v < FIRST + STATES) now->state[v - FIRST] = value[k];
    else return FAILED;
  }
  return OK;
}

/* there are no variables of other types */
API Status fmi2GetInteger(void *i, const Reference *r, size_t n, int *v) { return n ? FAILED : OK; }
API Status fmi2GetBoolean(void *i, const Reference *r, size_t n, int *v) { return n ? FAILED : OK; }
API Status fmi2GetString(void *i, const Reference *r, size_t n, String *v) { return n ? FAILED : OK; }
API Status fmi2SetInteger(void *i, const Reference *r, size_t n, const int *v) { return n ? FAILED : OK; }
API Status fmi2SetBoolean(void *i, const Reference *r, size_t n, const int *v) { return n ? FAILED : OK; }
API Status fmi2SetString(void *i, const Reference *r, size_t n, const String *v) { return n ? FAILED : OK; }

/* capabilities that modelDescription.xml does not promise */
API Status fmi2GetFMUstate(void *i, void **s) { return FAILED; }
API Status fmi2SetFMUstate(void *i, void *s) { return FAILED; }
API Status fmi2FreeFMUstate(void *i, void **s) { return FAILED; }
API Status fmi2SerializedFMUstateSize(void *i, void *s, size_t *n) { return FAILED; }
API Status fmi2SerializeFMUstate(void *i, void *s, char *b, size_t n) { return FAILED; }
API Status fmi2DeSerializeFMUstate(void *i, const char *b, size_t n, void **s) { return FAILED; }
API Status fmi2GetDirectionalDerivative(void *i, const Reference *u, size_t nu, const Reference *k,
                                        size_t nk, const double *dk, double *du) {
  return FAILED;
}

API Status fmi2EnterEventMode(void *i) { return OK; }
API Status fmi2NewDiscreteStates(void *i, EventInfo *info) {
  memset(info, 0, sizeof(EventInfo));
  return OK;
}
API Status fmi2EnterContinuousTimeMode(void *i) { return OK; }
API Status fmi2CompletedIntegratorStep(void *i, int keep, int *event, int *terminate) {
  *event = *terminate = 0;
  return OK;
}
API Status fmi2SetTime(void *i, double time) { return OK; }
API Status fmi2SetContinuousStates(void *i, const double *x, size_t n) {
  if (n != STATES) return FAILED;
  memcpy(((Instance *)i)->state, x, sizeof(double) * STATES);
  return OK;
}
API Status fmi2GetContinuousStates(void *i, double *x, size_t n) {
  if (n != STATES) return FAILED;
  memcpy(x, ((Instance *)i)->state, sizeof(double) * STATES);
  return OK;
}
API Status fmi2GetDerivatives(void *i, double *out, size_t n) {
  if (n != STATES) return FAILED;
  slopes(i, out);
  return OK;
}
API Status fmi2GetEventIndicators(void *i, double *out, size_t n) { return n ? FAILED : OK; }
API Status fmi2GetNominalsOfContinuousStates(void *i, double *out, size_t n) {
  if (n != STATES) return FAILED;
  for (int r = 0; r < MODES; r++) {
    out[r] = AMPLITUDE;
    out[MODES + r] = AMPLITUDE * FREQUENCY;
  }
  return OK;
}
